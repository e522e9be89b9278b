#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/look/plan.h"
#include "apps/look/shown.h"

namespace nephele::apps {

/// A picture that a page asks for.
struct LookRequest {
  std::string page;
  std::int64_t revision = 0;
  std::shared_ptr<const LookPlan> plan;
  int width = 640, height = 360;
  /// Only what comes in time: something is being dragged.
  bool hurries = false;
  LookShow show{};
  /// Gave way to another page's first picture, and does not again to one that did so, too.
  bool hasGivenWay = false;
  /// When the engine learned of it.
  std::chrono::steady_clock::time_point asked{};
};

/// Many small pictures of what differs in a setting or two.
struct LookWedge {
  static constexpr std::size_t kMostCells = 100;

  std::string page;
  std::int64_t revision = 0;
  struct Cell {
    std::string label;
    std::shared_ptr<const LookPlan> plan;
  };
  std::vector<Cell> cells;
  /// Those before it are made.
  std::size_t next = 0;
  int width = 320, height = 180;
  LookShow show{};
};

/// `name`, if a page may be called so. @throws LookFault.
const std::string& checkedPage(const std::string& name);

/// What pages send, as docs/look.md describes it. @throws LookFault naming what is wrong.
LookRequest requestOf(const LookSubject& subject, const nlohmann::json& body);
LookWedge wedgeOf(const LookSubject& subject, const nlohmann::json& body);
std::shared_ptr<const LookPlan> planOf(const LookSubject& subject, const nlohmann::json& body);
/// Leaves both as they are where the body says nothing of them.
void readSize(const nlohmann::json& body, int& width, int& height);

}  // namespace nephele::apps
