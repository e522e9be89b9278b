#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "apps/look/page.h"
#include "apps/look/requests.h"
#include "apps/look/shapes.h"
#include "apps/look/tier.h"

namespace nephele::apps {

/// Makes the pictures of all pages, on one thread that uses all cores: coarse ones first, then finer ones. A
/// newer request of a page ends the work on its older ones.
class LookEngine {
 public:
  explicit LookEngine(double memoryLimitBytes);
  /// Ends all work.
  ~LookEngine();
  LookEngine(const LookEngine&) = delete;
  LookEngine& operator=(const LookEngine&) = delete;

  static constexpr std::size_t kMostPages = 10;
  /// What waits for the page of this name; a page that was there under it is closed. Null where there are too
  /// many pages.
  std::shared_ptr<LookPage> open(const std::string& page);
  void close(const std::string& page, const std::shared_ptr<LookPage>& which);
  void closeAll();
  /// To all pages.
  void tell(const nlohmann::json& message);
  void tell(const std::string& page, const nlohmann::json& message);

  void ask(LookRequest request);
  void ask(LookWedge wedge);
  /// Value of the last picture of a page, at a share of its width and height; null where there is none.
  nlohmann::json pixel(const std::string& page, double x, double y) const;

 private:
  struct Page {
    std::shared_ptr<LookPage> messages;
    std::shared_ptr<const Image> image;
    std::int64_t asked = 0;
  };
  class Work;

  void run();
  void make(const LookRequest& request);
  void make(LookWedge& wedge);
  void show(const LookRequest& request, LookPlan::Tier tier, const LookFrame& frame, int level, bool isFinal,
            Work& work);
  LookPicture picture(LookTier& tier, const LookPlan& plan, const LookFrame& frame, Run& run);
  void sendFault(const std::string& page, std::int64_t revision, const std::exception& error);

  const double memoryLimitBytes_;
  mutable std::mutex mutex_;
  std::condition_variable asked_;
  std::map<std::string, Page> pages_;
  // The latest of each page, in the order in which they came.
  std::deque<LookRequest> requests_;
  std::deque<LookWedge> wedges_;
  std::atomic<bool> stops_{false};
  // What is worked on.
  std::string workingFor_;
  bool isOnWedge_ = false;
  std::atomic<bool> isOutdated_{false}, yields_{false};
  // Of the worker alone.
  LookTier coarse_{LookPlan::Tier::coarse}, fine_{LookPlan::Tier::fine}, small_{LookPlan::Tier::coarse};
  LookShapes shapes_;
  std::thread worker_;
};

}  // namespace nephele::apps
