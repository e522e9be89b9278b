// What python_bench.py measures the module against: the same fields at the same number of points in C++, on
// all threads: of points in rows as Python's are, or in three arrays; into a new array, or one that was
// written before. Prints seconds of the fastest run, as `field, case seconds` lines.
#include <chrono>
#include <cstdio>
#include <memory>
#include <random>
#include <vector>

#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/noise/noise.h"
#include "nephele/modeling/shape/shapes.h"

namespace nephele {
namespace {

constexpr std::size_t kPoints = 10'000'000, kPiece = 2048;

struct Points {
  std::vector<float> rows, x, y, z;

  Points() : rows(3 * kPoints), x(kPoints), y(kPoints), z(kPoints) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> uniform(-2, 2);
    for (std::size_t i = 0; i < kPoints; ++i) {
      rows[3 * i] = x[i] = uniform(random);
      rows[3 * i + 1] = y[i] = uniform(random);
      rows[3 * i + 2] = z[i] = uniform(random);
    }
  }
};

void evalColumns(const ScalarField& field, const Points& points, float* values) {
  parallelFor(kPoints, kPiece, [&](std::size_t begin, std::size_t end) {
    const auto part = [&](const std::vector<float>& lane) {
      return std::span(lane).subspan(begin, end - begin);
    };
    field.eval({part(points.x), part(points.y), part(points.z)},
               Spans<1>(std::span(values + begin, end - begin)));
  });
}

void evalRows(const ScalarField& field, const Points& points, float* values) {
  parallelFor(kPoints, kPiece, [&](std::size_t begin, std::size_t end) {
    const std::size_t count = end - begin;
    float x[kPiece], y[kPiece], z[kPiece];
    const float* p = points.rows.data() + 3 * begin;
    for (std::size_t i = 0; i < count; ++i) {
      x[i] = p[3 * i];
      y[i] = p[3 * i + 1];
      z[i] = p[3 * i + 2];
    }
    field.eval({{x, count}, {y, count}, {z, count}}, Spans<1>(std::span(values + begin, count)));
  });
}

template <class Work>
void measure(const char* name, const Work& work) {
  double best = 1e30;
  for (int run = 0; run < 7; ++run) {
    const auto start = std::chrono::steady_clock::now();
    work();
    best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  std::printf("%s %.6f\n", name, best);
}

}  // namespace
}  // namespace nephele

int main() {
  using namespace nephele;
  const Points points;
  std::vector<float> values(kPoints);
  const ScalarField ball = sphere({0, 0, 0}, 1.0f);
  const ScalarField cloud = ball + 0.1f * abs(fractalSum({.octaves = 4, .frequency = 3.0f}));
  const auto intoNew = [&](const ScalarField& field) {
    const std::unique_ptr<float[]> fresh(new float[kPoints]);
    evalRows(field, points, fresh.get());
  };
  measure("cloud, new_array", [&] { intoNew(cloud); });
  measure("sphere, new_array", [&] { intoNew(ball); });
  measure("sphere, written_again", [&] { evalRows(ball, points, values.data()); });
  measure("sphere, columns_written_again", [&] { evalColumns(ball, points, values.data()); });
}
