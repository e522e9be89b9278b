#include "apps/felt/explain.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <optional>

namespace nephele::apps {
namespace {

using felt::Kind;
using felt::Named;

constexpr std::size_t kPoints = 4096;
/// Blocks as large as those in which grids are filled.
constexpr std::size_t kBlock = 512;
/// What one field may take, but for the block that it is in.
constexpr double kSeconds = 0.1;

std::optional<felt::Domain> domainOf(const Named& named) {
  if (!named.value.isSet() || named.type.isArray) return std::nullopt;
  switch (named.type.kind) {
    case Kind::domain:
      return named.value.as<felt::Domain>();
    case Kind::scalarCache:
      return named.value.as<std::shared_ptr<felt::Cache<float>>>()->domain;
    case Kind::vectorCache:
      return named.value.as<std::shared_ptr<felt::Cache<Vec3f>>>()->domain;
    case Kind::matrixCache:
      return named.value.as<std::shared_ptr<felt::Cache<Mat3f>>>()->domain;
    default:
      return std::nullopt;
  }
}

bool hasValues(const Named& named) {
  switch (named.type.kind) {
    case Kind::scalarCache:
      return named.value.as<std::shared_ptr<felt::Cache<float>>>()->values.has_value();
    case Kind::vectorCache:
      return named.value.as<std::shared_ptr<felt::Cache<Vec3f>>>()->values.has_value();
    default:
      return named.value.as<std::shared_ptr<felt::Cache<Mat3f>>>()->values.has_value();
  }
}

/// Points that fill a box evenly, in the order of Halton's sequence.
struct EvenPoints {
  explicit EvenPoints(const Box& box) {
    const auto digitsMirrored = [](std::size_t i, std::size_t base) {
      double result = 0, place = 1.0 / double(base);
      for (; i > 0; i /= base, place /= double(base)) result += place * double(i % base);
      return result;
    };
    for (std::size_t i = 1; i <= kPoints; ++i) {
      x.push_back(float(std::lerp(box.min.x, box.max.x, digitsMirrored(i, 2))));
      y.push_back(float(std::lerp(box.min.y, box.max.y, digitsMirrored(i, 3))));
      z.push_back(float(std::lerp(box.min.z, box.max.z, digitsMirrored(i, 5))));
    }
  }
  PointSpans block(std::size_t begin) const {
    const auto part = [&](const std::vector<float>& all) { return std::span(all).subspan(begin, kBlock); };
    return {part(x), part(y), part(z)};
  }

  std::vector<float> x, y, z;
};

/// Nanoseconds that a point costs on one thread: the least of three rounds, or of as many blocks as there is
/// time for.
template <class T>
double costOf(const Field<T>& field, const EvenPoints& points, const Run& run) {
  using Clock = std::chrono::steady_clock;
  std::vector<float> values(kBlock * kComponents<T>);
  const Spans<kComponents<T>> spans = [&] {
    if constexpr (kComponents<T> == 1) {
      return Spans<1>(values);
    } else {
      Spans<kComponents<T>> parts;
      for (int i = 0; i < kComponents<T>; ++i) parts.lanes[i] = std::span(values).subspan(i * kBlock, kBlock);
      return parts;
    }
  }();
  double least = std::numeric_limits<double>::infinity();
  const auto start = Clock::now();
  const auto isLate = [&] { return std::chrono::duration<double>(Clock::now() - start).count() > kSeconds; };
  for (int round = 0; round < 3 && !isLate(); ++round) {
    const auto from = Clock::now();
    std::size_t done = 0;
    while (done < kPoints && (done == 0 || !isLate())) {
      run.check();
      field.eval(points.block(done), spans);
      done += kBlock;
    }
    least = std::min(least, std::chrono::duration<double, std::nano>(Clock::now() - from).count() / done);
  }
  return least;
}

double costOf(const Named& named, const EvenPoints& points, const Run& run) {
  switch (named.type.kind) {
    case Kind::scalarField:
      return costOf(named.value.as<ScalarField>(), points, run);
    case Kind::vectorField:
      return costOf(named.value.as<VectorField>(), points, run);
    default:
      return costOf(named.value.as<MatrixField>(), points, run);
  }
}

std::string text(const Vec3f& v) {
  return fmt::format("({:g}, {:g}, {:g})", v.x, v.y, v.z);
}

void explainParameter(const felt::ScriptParameter& parameter, Run& run) {
  std::string line =
      fmt::format("param {} {} = {}", typeName(parameter.type), parameter.name, parameter.standard);
  if (parameter.isColor) line += " in color";
  if (!parameter.allowed.empty()) line += fmt::format(" in [{}]", fmt::join(parameter.allowed, ", "));
  run.result(line + (parameter.text.empty() ? "" : ": " + parameter.text));
}

void explainField(const Named& named, const EvenPoints& points, Run& run) {
  const double cost = costOf(named, points, run);
  run.result(fmt::format("{}: {} of {} operation{}, {:.3g} ns per point", named.name, typeName(named.type),
                         named.operations, named.operations == 1 ? "" : "s", cost));
  run.stats["fields"].push_back({{"name", named.name},
                                 {"type", typeName(named.type)},
                                 {"operations", named.operations},
                                 {"nanoseconds_per_point", cost}});
}

void explainCache(const Named& named, const felt::Domain& domain, Run& run) {
  const auto cells = domain.cells();
  run.result(fmt::format("{}: {} of {} x {} x {} cells, each {} wide, {}", named.name, typeName(named.type),
                         cells.x, cells.y, cells.z, text(felt::toFloat(domain.cell)),
                         hasValues(named) ? "written" : "never written"));
  run.stats["caches"].push_back({{"name", named.name},
                                 {"type", typeName(named.type)},
                                 {"cells", {cells.x, cells.y, cells.z}},
                                 {"written", hasValues(named)}});
}

}  // namespace

Box boxOfInterest(const std::vector<Named>& variables) {
  for (const Named& named : variables)
    if (const auto domain = domainOf(named)) return domain->bounds();
  for (const Named& named : variables)
    if (named.type == felt::Type{Kind::shape} && named.value.isSet())
      return Box(boundingBox(named.value.as<std::shared_ptr<const felt::Shape>>()->mesh));
  return {{-1, -1, -1}, {1, 1, 1}};
}

void explain(const felt::Program& program, const std::vector<Named>& variables, Run& run) {
  run.begin("explain");
  for (const felt::ScriptParameter& parameter : program.parameters()) explainParameter(parameter, run);
  const Box box = boxOfInterest(variables);
  const EvenPoints points(box);
  for (const char* list : {"fields", "caches"}) run.stats[list] = nlohmann::json::array();
  bool hasFields = false;
  for (const Named& named : variables) {
    if (!named.value.isSet()) continue;
    if (named.type.isField()) {
      hasFields = true;
      explainField(named, points, run);
    } else if (named.type.kind != Kind::domain) {
      if (const auto domain = domainOf(named)) explainCache(named, *domain, run);
    }
  }
  if (hasFields)
    run.result(fmt::format("Costs are those of {} points between {} and {} on one thread.", kPoints,
                           text(box.min), text(box.max)));
}

}  // namespace nephele::apps
