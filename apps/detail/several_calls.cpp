#include "apps/detail/several_calls.h"

#include <fmt/format.h>

#include <filesystem>

#include "apps/options/outputs.h"
#include "apps/options_digest.h"
#include "nephele/modeling/base/error.h"
#include "nephele/render/session/picture_stages.h"

namespace nephele::apps {
namespace {

/// Options by which a call is not what it makes.
constexpr std::string_view kNotOfCalls[]{"frames", "only", "shard"};

/// Of all inputs together, or of those of one sequence after the other; empty where the verb chooses nothing
/// by them.
std::vector<Extent> measured(const Verb& verb, const SeveralCalls& calls, ProgramRun& run) {
  std::vector<Extent> ranges;
  if (!calls.variesInputs) return ranges;
  run.beginPart("measure", 0, 0.05);
  for (std::size_t i = 0; i != calls.count; ++i) {
    const Call call = calls.at(i);
    Command command(verb);
    command.parse(call.arguments);
    if (!command.bound.measure) break;
    run.check();
    run.part = call.part;
    run.begin(call.name);
    const Extent one = command.bound.measure(run);
    if (calls.rangeOf(i) == ranges.size())
      ranges.push_back(one);
    else
      ranges.back().include(one);
  }
  run.part.reset();
  run.endPart();
  return ranges;
}

nlohmann::json described(const Extent& range) {
  const auto corner = [](const Vec3f& p) { return nlohmann::json{p.x, p.y, p.z}; };
  return {{"box", {corner(range.box.min), corner(range.box.max)}}, {"longest_side", range.longestSide}};
}

bool isThere(const Command& command, const std::string& digest, const Run& run) {
  const std::vector<std::string> outputs = outputsOf(command.app);
  for (const std::string& path : outputs) {
    if (!std::filesystem::exists(path)) return false;
    const std::string defect = outputDefect(path, digest);
    if (defect.empty()) continue;
    run.note(fmt::format("{}: {}; it is made again", path, defect));
    return false;
  }
  return !outputs.empty();
}

}  // namespace

std::vector<MadeCall> makeCalls(const Verb& verb, const SeveralCalls& calls, ProgramRun& run) {
  const std::vector<Extent> ranges = measured(verb, calls, run);
  auto list = nlohmann::json::array();
  std::vector<MadeCall> made;
  std::size_t skipped = 0;
  const std::size_t count = calls.made.size();
  if (count > 1 && !run.pictureStages) run.pictureStages = std::make_shared<PictureStages>();
  for (std::size_t i = 0; i != count; ++i) {
    const Call call = calls.at(calls.made[i]);
    try {
      run.check();
      Command command(verb);
      command.parse(call.arguments);
      const double share = 0.95 / double(count);
      run.part = call.part;
      if (!ranges.empty()) run.part->range = ranges[calls.rangeOf(calls.made[i])];
      const std::optional<Extent> range = run.part->range;
      run.beginPart(call.name, 0.05 + share * double(i), 0.05 + share * double(i + 1));
      run.part->digest = optionsDigest(
          command.app, kNotOfCalls,
          fmt::format("{} {}", call.part.framesSinceFirst, range ? range->text() : ""), run.files);
      const bool skips = calls.skipExisting && isThere(command, run.part->digest, run);
      skipped += skips;
      if (!skips) command.bound.body(run);
      nlohmann::json entry = {{"name", call.name}, {"skipped", skips}};
      if (call.values.is_object()) entry.update(call.values);
      entry.update(run.endPart());
      list.push_back(std::move(entry));
      made.push_back({call.name, givenValue(command.app, "--output"), givenValue(command.app, "--preview"),
                      command.options.look});
    } catch (const std::exception&) {
      run.endPart();
      run.note(
          fmt::format("ended at {}: {} of {} {} are whole; the same call with --skip-existing makes the rest",
                      call.name, i, count, calls.word));
      throw;
    }
  }
  run.part.reset();
  if (skipped > 0) run.note(fmt::format("{} of {} {} were there and whole", skipped, count, calls.word));
  run.stats[calls.list] = std::move(list);
  if (ranges.size() == 1) run.stats["range"] = described(ranges.front());
  for (std::size_t i = 0; ranges.size() > 1 && i != ranges.size(); ++i)
    run.stats["ranges"].push_back(described(ranges[i]));
  return made;
}

}  // namespace nephele::apps
