#include "apps/look/engine.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/felt/diagnostic.h"

namespace nephele::apps {
namespace {

using Clock = std::chrono::steady_clock;

nlohmann::json jsonOf(const Vec3d& v) {
  return {v.x, v.y, v.z};
}

/// What a drag may take for its picture, seconds.
constexpr double kDragSeconds = 0.035, kSoonSeconds = 0.12;

bool isOfShapes(const LookPlan& plan) {
  return plan.what == LookShow::What::pieces || plan.what == LookShow::What::transfer;
}

/// What a page learns of a picture, whatever it was asked for.
nlohmann::json describedPicture(const LookPicture& picture) {
  const Camera& camera = picture.camera;
  const Vec3d middle(picture.bounds.isEmpty() ? Vec3f{} : picture.bounds.center());
  const double away = dot(middle - camera.position(), camera.forward());
  const double distance = away > 0 ? away : length(middle - camera.position());
  nlohmann::json layers = {"beauty", "depth", "normal", "transmittance", "albedo"};
  for (const std::string& name : picture.options.lights.names()) layers.push_back("light_" + name);
  nlohmann::json message = {
      {"rays", picture.rays},
      {"rays_per_pixel", double(picture.rays) / (double(picture.image->width) * picture.image->height)},
      {"voxels", picture.voxelSize > 0 && !picture.bounds.isEmpty()
                     ? picture.bounds.longestSide() / picture.voxelSize
                     : 0.0},
      {"camera",
       {{"position", jsonOf(camera.position())},
        {"look_at", jsonOf(camera.position() + camera.forward() * distance)},
        {"up", jsonOf(camera.up())},
        {"fov",
         camera.isOrthographic() ? 0.0 : 2 * std::atan(camera.screenWidth() / 2) * 180 / std::numbers::pi},
        {"orthographic_width", camera.isOrthographic() ? camera.screenWidth() : 0.0}}},
      {"layers", layers}};
  if (picture.options.extinction) message["extinction"] = *picture.options.extinction;
  if (!picture.bounds.isEmpty())
    message["bounds"] = {jsonOf(Vec3d(picture.bounds.min)), jsonOf(Vec3d(picture.bounds.max))};
  if (!picture.options.lights.suns.empty()) {
    const Vec3f sun = normalize(picture.options.lights.suns[0].direction);
    const double degrees = 180 / std::numbers::pi;
    message["sun"] = {std::atan2(sun.x, sun.z) * degrees,
                      std::asin(std::clamp(sun.y, -1.0f, 1.0f)) * degrees};
  }
  return message;
}

}  // namespace

/// The Run behind pictures of one page: tells it of stages and notes, and learns of newer requests.
class LookEngine::Work : public Run {
 public:
  Work(LookEngine& engine, std::string page, std::int64_t revision)
      : engine_(engine), page_(std::move(page)), revision_(revision) {
    memoryLimitBytes = engine.memoryLimitBytes_;
  }

  void begin(std::string_view stage) const override {
    const std::lock_guard lock(mutex_);
    stage_ = stage;
    told_ = Clock::now();
  }
  void advance(double fraction) const override {
    constexpr double kBetween = 0.1;
    {
      const std::unique_lock lock(mutex_, std::try_to_lock);
      if (!lock || secondsSince(told_) < kBetween) return;
      told_ = Clock::now();
    }
    engine_.tell(page_, {{"type", "progress"},
                         {"revision", revision_},
                         {"stage", stage_},
                         {"fraction", fraction},
                         {"seconds", secondsSince(start_)}});
  }
  void note(std::string_view message) const override {
    engine_.tell(page_, {{"type", "note"}, {"revision", revision_}, {"message", std::string(message)}});
  }
  bool cancelled() const override {
    return engine_.stops_ || engine_.isOutdated_ || (mayYield && engine_.yields_);
  }
  void expect(double, double, int) const override {}
  void detail(std::string_view) const override {}
  void result(const std::string&) const override {}

  double seconds() const { return secondsSince(start_); }
  /// From then until this work began: what older work took to end.
  double waited(Clock::time_point asked) const {
    return std::chrono::duration<double>(start_ - asked).count();
  }

  /// Somebody else's first picture goes before this work.
  bool mayYield = false;

 private:
  LookEngine& engine_;
  std::string page_;
  std::int64_t revision_;
  const Clock::time_point start_ = Clock::now();
  mutable std::mutex mutex_;
  mutable std::string stage_;
  mutable Clock::time_point told_ = start_;
};

LookEngine::LookEngine(double memoryLimitBytes)
    : memoryLimitBytes_(memoryLimitBytes), worker_([this] { run(); }) {}

LookEngine::~LookEngine() {
  stops_ = true;
  asked_.notify_all();
  worker_.join();
  const std::lock_guard lock(mutex_);
  for (auto& [name, page] : pages_) page.messages->close();
}

std::shared_ptr<LookPage> LookEngine::open(const std::string& page) {
  const std::lock_guard lock(mutex_);
  if (!pages_.contains(page) && pages_.size() >= kMostPages) return nullptr;
  Page& own = pages_[page];
  if (own.messages) own.messages->close();
  own.messages = std::make_shared<LookPage>();
  return own.messages;
}

void LookEngine::close(const std::string& page, const std::shared_ptr<LookPage>& which) {
  const std::lock_guard lock(mutex_);
  const auto found = pages_.find(page);
  if (found == pages_.end() || found->second.messages != which) return;
  which->close();
  pages_.erase(found);
  std::erase_if(requests_, [&](const LookRequest& request) { return request.page == page; });
  std::erase_if(wedges_, [&](const LookWedge& wedge) { return wedge.page == page; });
  if (workingFor_ == page) isOutdated_ = true;
}

void LookEngine::closeAll() {
  const std::lock_guard lock(mutex_);
  for (auto& [name, page] : pages_) page.messages->close();
}

void LookEngine::tell(const nlohmann::json& message) {
  const std::lock_guard lock(mutex_);
  for (auto& [name, page] : pages_) page.messages->send(message);
}

void LookEngine::tell(const std::string& page, const nlohmann::json& message) {
  const std::lock_guard lock(mutex_);
  if (const auto found = pages_.find(page); found != pages_.end()) found->second.messages->send(message);
}

void LookEngine::ask(LookRequest request) {
  request.asked = Clock::now();
  {
    const std::lock_guard lock(mutex_);
    const auto found = pages_.find(request.page);
    if (found != pages_.end()) {
      // One that was overtaken on its way.
      if (request.revision < found->second.asked) return;
      found->second.asked = request.revision;
    }
    std::erase_if(requests_, [&](const LookRequest& older) { return older.page == request.page; });
    if (workingFor_ == request.page)
      isOutdated_ = true;
    else
      yields_ = true;
    requests_.push_back(std::move(request));
  }
  asked_.notify_all();
}

void LookEngine::ask(LookWedge wedge) {
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(wedges_, [&](const LookWedge& older) { return older.page == wedge.page; });
    if (workingFor_ == wedge.page && isOnWedge_) isOutdated_ = true;
    wedges_.push_back(std::move(wedge));
  }
  asked_.notify_all();
}

nlohmann::json LookEngine::pixel(const std::string& page, double x, double y) const {
  std::shared_ptr<const Image> image;
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = pages_.find(page); found != pages_.end()) image = found->second.image;
  }
  if (!image || !(x >= 0 && x <= 1 && y >= 0 && y <= 1)) return nullptr;
  const int column = std::min(int(x * image->width), image->width - 1),
            row = std::min(int(y * image->height), image->height - 1);
  const auto value = [&](const char* name) { return image->at(name, column, row); };
  nlohmann::json result = {
      {"rgb", {value("R"), value("G"), value("B")}}, {"alpha", value("A")}, {"depth", nullptr}};
  if (image->find("Z") && std::isfinite(value("Z"))) result["depth"] = value("Z");
  return result;
}

void LookEngine::run() {
  while (true) {
    std::optional<LookRequest> request;
    std::optional<LookWedge> wedge;
    {
      std::unique_lock lock(mutex_);
      workingFor_.clear();
      asked_.wait(lock, [&] { return stops_ || !requests_.empty() || !wedges_.empty(); });
      if (stops_) return;
      isOutdated_ = false;
      isOnWedge_ = requests_.empty();
      yields_ = requests_.size() > 1 &&
                std::any_of(std::next(requests_.begin()), requests_.end(),
                            [](const LookRequest& waiting) { return !waiting.hasGivenWay; });
      if (!requests_.empty()) {
        request = std::move(requests_.front());
        requests_.pop_front();
        workingFor_ = request->page;
      } else {
        wedge = std::move(wedges_.front());
        wedges_.pop_front();
        workingFor_ = wedge->page;
      }
    }
    if (request)
      make(*request);
    else
      make(*wedge);
  }
}

void LookEngine::sendFault(const std::string& page, std::int64_t revision, const std::exception& error) {
  nlohmann::json message = {
      {"type", "error"}, {"revision", revision}, {"verb", ""}, {"option", ""}, {"text", ""}};
  const LookFault fault("", error.what());
  message["message"] = fault.what();
  message["option"] = fault.option();
  if (const auto* own = dynamic_cast<const LookFault*>(&error)) message["verb"] = own->verb();
  if (dynamic_cast<const felt::ScriptError*>(&error)) message["text"] = error.what();
  tell(page, message);
}

LookPicture LookEngine::picture(LookTier& tier, const LookPlan& plan, const LookFrame& frame, Run& run) {
  if (isOfShapes(plan)) return shapes_.picture(plan, frame, run);
  return tier.picture(plan, frame, &tier == &fine_ ? nullptr : &fine_, run);
}

void LookEngine::show(const LookRequest& request, LookPlan::Tier tier, const LookFrame& frame, int level,
                      bool isFinal, Work& work) {
  LookTier& own = tier == LookPlan::Tier::coarse ? coarse_ : fine_;
  const auto start = Clock::now();
  const LookPicture picture = this->picture(own, *request.plan, frame, work);
  std::string bytes = shownJpeg(*picture.image, request.show, picture.options.screen, isFinal ? 92 : 80);
  nlohmann::json message = describedPicture(picture);
  message.update({{"type", "picture"},
                  {"revision", request.revision},
                  {"level", level},
                  {"final", isFinal},
                  {"width", frame.width},
                  {"height", frame.height},
                  {"mime", "image/jpeg"},
                  {"turns", request.show.what == LookShow::What::transfer},
                  {"milliseconds", 1000 * secondsSince(start)},
                  {"seconds", work.seconds()},
                  {"waited", work.waited(request.asked)},
                  {"stage", isFinal                          ? "final"
                            : tier == LookPlan::Tier::coarse ? "coarse"
                                                             : "fine"}});
  const std::lock_guard lock(mutex_);
  const auto found = pages_.find(request.page);
  if (found == pages_.end() || isOutdated_) return;
  found->second.image = picture.image;
  found->second.messages->send(message, std::move(bytes));
}

void LookEngine::make(const LookRequest& request) {
  using Tier = LookPlan::Tier;
  Work work(*this, request.page, request.revision);
  const CancelScope scope(&work);
  const auto sized = [&](double share, int samples) {
    return LookFrame{std::max(int(std::lround(request.width * share)), 16),
                     std::max(int(std::lround(request.height * share)), 9), samples, request.show};
  };
  try {
    const double pixels = double(request.width) * request.height;
    const LookPlan& plan = *request.plan;
    const bool isVolume = request.show.isVolume(), isReady = !isOfShapes(plan) && fine_.isReady(plan);
    const Tier first = isReady ? Tier::fine : Tier::coarse;
    const LookPace& pace = isOfShapes(plan) ? shapes_.pace() : (isReady ? fine_ : coarse_).pace(isVolume);
    const int samples = plan.picture.render.samples;
    const bool isSoon =
        isReady && isVolume && !request.hurries && pace.expectedSeconds(pixels * samples) < kSoonSeconds;
    if (!isSoon && !request.hasGivenWay) {
      // In steps, so that what needs no march is not marched at another size.
      constexpr double kSteps = 8;
      const double fits = std::sqrt(kDragSeconds / pace.expectedSeconds(pixels));
      const double share = std::clamp(std::floor(fits * kSteps) / kSteps, 0.25, 1.0);
      show(request, first, sized(share, 1), 0, false, work);
    }
    if (request.hurries) return;
    work.mayYield = true;
    show(request, Tier::fine, sized(1, 0), 2, true, work);
    tell(request.page, {{"type", "idle"}, {"revision", request.revision}, {"seconds", work.seconds()}});
  } catch (const Cancelled&) {
    const std::lock_guard lock(mutex_);
    // Another page's first picture went before: this goes on afterwards.
    if (stops_ || isOutdated_) return;
    requests_.push_back(request);
    requests_.back().hasGivenWay = true;
  } catch (const std::bad_alloc&) {
    sendFault(request.page, request.revision, Error("out of memory; lower the resolution"));
  } catch (const std::exception& error) {
    sendFault(request.page, request.revision, error);
  }
}

void LookEngine::make(LookWedge& wedge) {
  Work work(*this, wedge.page, wedge.revision);
  const CancelScope scope(&work);
  work.mayYield = true;
  for (std::size_t& i = wedge.next; i < wedge.cells.size(); ++i) {
    nlohmann::json message = {{"type", "wedge"},
                              {"revision", wedge.revision},
                              {"index", i},
                              {"count", wedge.cells.size()},
                              {"label", wedge.cells[i].label},
                              {"mime", "image/jpeg"}};
    std::string bytes;
    try {
      const LookPicture made =
          picture(small_, *wedge.cells[i].plan, {wedge.width, wedge.height, 2, wedge.show}, work);
      bytes = shownJpeg(*made.image, wedge.show, made.options.screen, 88);
    } catch (const Cancelled&) {
      const std::lock_guard lock(mutex_);
      // It goes on after what was asked for meanwhile, unless its page is gone or has asked for another.
      const bool isWanted = pages_.contains(wedge.page) &&
                            std::ranges::find(wedges_, wedge.page, &LookWedge::page) == wedges_.end();
      if (!stops_ && isWanted) wedges_.push_front(std::move(wedge));
      return;
    } catch (const std::exception& error) {
      message["error"] = error.what();
    }
    const std::lock_guard lock(mutex_);
    if (const auto found = pages_.find(wedge.page); found != pages_.end())
      found->second.messages->send(message, std::move(bytes));
  }
}

}  // namespace nephele::apps
