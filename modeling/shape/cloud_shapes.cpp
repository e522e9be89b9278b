// A cloud is drawn from its seed from large to small. Columns come first: the tallest near the middle, then
// each next one leaning against one that is there already, so that the cloud is one piece, at the freest of
// several random places, and lower the farther it is from the middle. A column is a stack of lobes that
// overlap by more than half, with turrets around its top; every lobe bears buds on its upper side, spread
// evenly by taking the farthest of several random directions. Buds that would be buried are left out.
//
// The numbers of a species are proportions, in half widths of the cloud. Fillets are a share of the smaller
// radius, so the order in which parts are joined follows the order in which they grew; a column's parts lie
// close together, which keeps restriction to a box effective.
//
// Limits: columns do not know of wind shear but for a common lean, and nothing erodes them.
#include "nephele/modeling/shape/cloud_shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/noise/noise_draw.h"
#include "nephele/modeling/shape/combinations.h"
#include "nephele/modeling/shape/shapes.h"

namespace nephele {
namespace {

/// Least and largest of what is drawn.
struct Between {
  double low, high;
};

/// What tells one species from another.
struct Proportions {
  int fewestColumns, mostColumns;
  /// Columns that reach the full height or nearly.
  int fewestTowers, mostTowers;
  /// Of the tallest column.
  Between height;
  /// Of a tower and of other columns, at their widest.
  Between towerRadius, columnRadius;
  /// Height of a column at the rim, in that of the tallest.
  double rimHeight;
  /// Width across the long axis of the ground plan, in that along it.
  Between narrow;
  /// Height of a lobe over its width.
  double flatness;
  /// Radius at the top of a tower in that at its foot.
  Between taper;
};

constexpr std::array<Proportions, 3> kProportions{{
    {10, 14, 2, 3, {0.34, 0.48}, {0.32, 0.40}, {0.18, 0.30}, 0.45, {0.55, 0.85}, 0.78, {0.8, 1.0}},
    {9, 13, 2, 3, {1.20, 1.60}, {0.38, 0.48}, {0.24, 0.36}, 0.32, {0.65, 0.90}, 1.0, {0.7, 0.9}},
    {12, 16, 3, 5, {2.20, 2.65}, {0.38, 0.52}, {0.26, 0.40}, 0.25, {0.70, 1.00}, 1.0, {0.65, 0.85}},
}};

constexpr std::array<CloudSpecies, 3> kSpecies{CloudSpecies::humilis, CloudSpecies::mediocris,
                                               CloudSpecies::congestus};
constexpr std::array<std::string_view, 3> kNames{"humilis", "mediocris", "congestus"};

constexpr double kTurn = 6.283185307179586;

struct Lobe {
  Vec3d center;
  double radius;
};

/// A lobe and what grew on it.
struct Tuft {
  Lobe lobe;
  std::vector<Lobe> buds;
};

struct Column {
  /// Where it stands, in the ground plan.
  double x, z;
  double radius, height;
  bool tower;
  std::vector<Tuft> tufts;
};

class Grower {
 public:
  Grower(const Proportions& proportions, std::uint32_t seed) : p_(proportions), draw_(seed) {}

  std::vector<Column> columns() {
    placeColumns();
    const double leanTurn = between({0, kTurn}), lean = between({0.0, 0.22});
    leanX_ = lean * std::cos(leanTurn);
    leanZ_ = lean * std::sin(leanTurn);
    for (Column& column : columns_) stack(column);
    for (Column& column : columns_)
      for (Tuft& tuft : column.tufts) bud(tuft);
    turn();
    return std::move(columns_);
  }

 private:
  double between(const Between& b) { return b.low + (b.high - b.low) * double(draw_.uniform()); }
  int count(int fewest, int most) {
    return fewest + std::min(int(double(draw_.uniform()) * (most - fewest + 1)), most - fewest);
  }

  void placeColumns() {
    const int towers = count(p_.fewestTowers, p_.mostTowers);
    const int all = count(p_.fewestColumns, p_.mostColumns);
    const double tallest = between(p_.height);
    narrow_ = between(p_.narrow);
    for (int i = 0; i < all; ++i) {
      Column column{};
      column.tower = i < towers;
      column.radius = between(column.tower ? p_.towerRadius : p_.columnRadius);
      if (i == 0) {
        column.x = between({-0.25, 0.25});
        column.z = between({-0.12, 0.12});
      } else {
        standFree(column);
      }
      const double away = std::min(1.0, std::hypot(column.x, column.z / narrow_));
      const double share = i == 0         ? 1
                           : column.tower ? between({0.62, 0.88})
                                          : (1 - (1 - p_.rimHeight) * away) * between({0.55, 1.0});
      // Low columns are heaps: no higher than wide makes them needles, much lower makes them plates.
      column.height = std::max(tallest * share, 0.85 * column.radius * p_.flatness);
      if (!column.tower && column.height > 3.2 * column.radius) column.height = 3.2 * column.radius;
      columns_.push_back(column);
    }
  }

  /// Puts a column against one that stands, where others are farthest.
  void standFree(Column& column) {
    constexpr int kCandidates = 14;
    double best = -1e30;
    double x = 0, z = 0;
    for (int i = 0; i < kCandidates; ++i) {
      const Column& other = columns_[std::size_t(count(0, int(columns_.size()) - 1))];
      const double angle = between({0, kTurn});
      const double way =
          between(column.tower ? Between{0.5, 0.7} : Between{0.6, 0.85}) * (other.radius + column.radius);
      const double cx = other.x + way * std::cos(angle), cz = other.z + way * std::sin(angle);
      double room = 1e30;
      for (const Column& c : columns_)
        room = std::min(room, std::hypot(cx - c.x, cz - c.z) / (c.radius + column.radius));
      const double away = std::hypot(cx, cz / narrow_) + 0.7 * column.radius;
      const double score = std::min(room, 0.8) - 1.6 * std::max(0.0, away - 1.0);
      if (score > best) best = score, x = cx, z = cz;
    }
    column.x = x;
    column.z = z;
  }

  void stack(Column& column) {
    const double taper = between(p_.taper);
    const double lowest = column.radius * p_.flatness * between({0.15, 0.35});
    const double top = std::max(column.height, lowest + 1e-3);
    double x = column.x, z = column.z, y = lowest;
    double swayX = 0, swayZ = 0;
    while (true) {
      const double t = std::clamp((y - lowest) / top, 0.0, 1.0);
      // A waist above the foot and a fuller crown.
      const double profile = 1 - (1 - taper) * t + 0.10 * std::sin(kTurn * (0.25 + 1.1 * t)) - 0.10;
      const double radius = column.radius * profile * between({0.90, 1.10});
      const double bend = t * t * top;
      column.tufts.push_back({{{x + swayX + leanX_ * bend, y, z + swayZ + leanZ_ * bend}, radius}, {}});
      if (y + radius * p_.flatness >= top) break;
      const double step = std::min(between({0.55, 0.80}) * radius, top - y - 0.5 * radius);
      y += std::max(step, 0.25 * radius);
      swayX += between({-0.30, 0.30}) * radius;
      swayZ += between({-0.30, 0.30}) * radius;
    }
    const Lobe crown = column.tufts.back().lobe;
    turrets(column, crown);
    shoulders(column);
  }

  /// Heaps around the top of a column, some of them a lobe higher.
  void turrets(Column& column, const Lobe& crown) {
    const int number = column.tower ? count(3, 5) : count(2, 3);
    const double start = between({0, kTurn});
    for (int i = 0; i < number; ++i) {
      const double angle = start + kTurn * (i + between({-0.3, 0.3})) / number;
      const double rise = between({0.15, 0.85});
      const double side = std::sqrt(1 - rise * rise);
      const double radius = crown.radius * between({0.42, 0.66});
      const double way = crown.radius * between({0.62, 0.85});
      Lobe turret{crown.center + Vec3d{side * std::cos(angle), rise, side * std::sin(angle)} * way, radius};
      column.tufts.push_back({turret, {}});
      if (!column.tower || between({0, 1}) > 0.45) continue;
      turret.center += Vec3d{between({-0.35, 0.35}), between({0.55, 0.8}), between({-0.35, 0.35})} * radius;
      turret.radius *= between({0.7, 0.9});
      column.tufts.push_back({turret, {}});
    }
  }

  /// Heaps that lean out of the side of a tall column.
  void shoulders(Column& column) {
    const double slender = column.height / column.radius;
    const int number = std::min(7, int(slender * between({0.8, 1.4})));
    const std::size_t stacked = column.tufts.size();
    for (int i = 0; i < number; ++i) {
      const Lobe from = column.tufts[std::size_t(count(0, int(stacked) - 1))].lobe;
      const double angle = between({0, kTurn}), rise = between({-0.1, 0.5});
      const double side = std::sqrt(1 - rise * rise);
      const double radius = from.radius * between({0.45, 0.72});
      column.tufts.push_back({{from.center + Vec3d{side * std::cos(angle), rise, side * std::sin(angle)} *
                                                 (from.radius * between({0.6, 0.85})),
                               radius},
                              {}});
    }
  }

  /// Small lobes on the upper side of a large one.
  void bud(Tuft& tuft) {
    const int number = count(6, 10);
    std::vector<Vec3d> directions;
    for (int i = 0; i < number; ++i) {
      const Vec3d direction = farthest(directions);
      directions.push_back(direction);
      const double radius = tuft.lobe.radius * between({0.26, 0.50});
      const Lobe bud{tuft.lobe.center + direction * (tuft.lobe.radius * between({0.78, 0.95})), radius};
      if (!buried(bud)) tuft.buds.push_back(bud);
    }
  }

  Vec3d farthest(const std::vector<Vec3d>& taken) {
    constexpr int kCandidates = 8;
    Vec3d best{};
    double bestWay = -1;
    for (int i = 0; i < kCandidates; ++i) {
      const double rise = between({-0.25, 0.98}), angle = between({0, kTurn});
      const double side = std::sqrt(1 - rise * rise);
      const Vec3d direction{side * std::cos(angle), rise, side * std::sin(angle)};
      double way = 4;
      for (const Vec3d& other : taken) way = std::min(way, length(direction - other));
      if (way > bestWay) bestWay = way, best = direction;
    }
    return best;
  }

  bool buried(const Lobe& bud) const {
    if (bud.center.y + bud.radius <= 0) return true;
    for (const Column& column : columns_)
      for (const Tuft& tuft : column.tufts)
        if (length(bud.center - tuft.lobe.center) + 0.6 * bud.radius < tuft.lobe.radius) return true;
    return false;
  }

  /// Turns the ground plan about y by a random angle.
  void turn() {
    const double angle = between({-0.25, 0.25}) * kTurn / 2;
    const double c = std::cos(angle), s = std::sin(angle);
    const auto turned = [&](Lobe& lobe) {
      const Vec3d p = lobe.center;
      lobe.center = {c * p.x - s * p.z, p.y, s * p.x + c * p.z};
    };
    for (Column& column : columns_)
      for (Tuft& tuft : column.tufts) {
        turned(tuft.lobe);
        for (Lobe& lobe : tuft.buds) turned(lobe);
      }
  }

  const Proportions& p_;
  detail::Draw draw_;
  double narrow_ = 1, leanX_ = 0, leanZ_ = 0;
  std::vector<Column> columns_;
};

/// Lobes as fields in their final place and size, joined in the order in which they grew.
class Assembly {
 public:
  Assembly(const std::vector<Column>& columns, double flatness, float size) : flatness_(flatness) {
    Box around;
    for (const Column& column : columns)
      for (const Tuft& tuft : column.tufts) {
        around = around.including(boxOf(tuft.lobe));
        for (const Lobe& bud : tuft.buds) around = around.including(boxOf(bud));
      }
    around.min.y = 0;
    scale_ = size / around.longestSide();
    middle_ = around.center();
    middle_.y = 0;
    shape_.box = {(around.min - middle_) * scale_, (around.max - middle_) * scale_};
    std::vector<ScalarField> parts;
    for (const Column& column : columns) parts.push_back(joined(column));
    const ScalarField cloud = joinedAll(parts, kColumnFillet);
    const ScalarField above = plane({}, {0, 1, 0});
    shape_.level = -blend(-cloud, -above, kRim * scale_);
    // Fillets add to the lobes wherever several meet.
    shape_.box = shape_.box.expanded(kFilletRoom * scale_);
    shape_.box.min.y = 0;
  }

  CloudShape shape() && { return std::move(shape_); }

 private:
  /// Radii of fillets, in half widths or in the radius of what bears the smaller part.
  static constexpr float kColumnFillet = 0.07f, kTuftFillet = 0.22f, kBudFillet = 0.16f, kRim = 0.10f;
  static constexpr float kFilletRoom = 0.04f;

  Vec3f radiiOf(const Lobe& lobe) const { return Vec3f(Vec3d{1, flatness_, 1} * lobe.radius); }
  Box boxOf(const Lobe& lobe) const {
    return {Vec3f(lobe.center) - radiiOf(lobe), Vec3f(lobe.center) + radiiOf(lobe)};
  }

  ScalarField placed(const Lobe& lobe) {
    const CloudLobe put{(Vec3f(lobe.center) - middle_) * scale_, radiiOf(lobe) * scale_};
    shape_.lobes.push_back(put);
    return put.radii.x == put.radii.y ? sphere(put.center, put.radii.x) : ellipsoid(put.center, put.radii);
  }

  ScalarField joined(const Column& column) {
    std::vector<ScalarField> tufts;
    for (const Tuft& tuft : column.tufts) {
      std::vector<ScalarField> parts{placed(tuft.lobe)};
      for (const Lobe& bud : tuft.buds) parts.push_back(placed(bud));
      tufts.push_back(joinedAll(parts, kBudFillet * float(tuft.lobe.radius)));
    }
    return joinedAll(tufts, kTuftFillet * float(column.radius));
  }

  ScalarField joinedAll(std::span<const ScalarField> parts, float radius) const {
    if (parts.size() == 1) return parts[0];
    const std::size_t half = parts.size() / 2;
    return blend(joinedAll(parts.first(half), radius), joinedAll(parts.subspan(half), radius),
                 radius * scale_);
  }

  double flatness_;
  float scale_ = 1;
  Vec3f middle_{};
  CloudShape shape_;
};

}  // namespace

std::span<const CloudSpecies> cloudSpecies() {
  return kSpecies;
}

std::string_view speciesName(CloudSpecies species) {
  require(std::size_t(species) < kNames.size(), "speciesName: there is no such species");
  return kNames[std::size_t(species)];
}

CloudShape cloudShape(const CloudShapeOptions& options) {
  require(options.size > 0 && std::isfinite(options.size),
          "cloudShape: size must be > 0 and finite, got " + numberText(options.size));
  require(std::size_t(options.species) < kProportions.size(), "cloudShape: there is no such species");
  const Proportions& proportions = kProportions[std::size_t(options.species)];
  return Assembly(Grower(proportions, options.seed).columns(), proportions.flatness, options.size).shape();
}

}  // namespace nephele
