// What python_bench.py measures the module against: the same fields at the same number of points in C++, on
// all threads, points in three arrays. Prints nanoseconds per point of the fastest run, as `name seconds`
// lines.
#include <chrono>
#include <cstdio>
#include <random>
#include <vector>

#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/noise/noise.h"
#include "nephele/modeling/shape/shapes.h"

int main() {
  using namespace nephele;
  constexpr std::size_t kPoints = 10'000'000, kPiece = 4096;
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(-2, 2);
  std::vector<float> x(kPoints), y(kPoints), z(kPoints), values(kPoints);
  for (std::size_t i = 0; i < kPoints; ++i) {
    x[i] = uniform(random);
    y[i] = uniform(random);
    z[i] = uniform(random);
  }
  const ScalarField ball = sphere({0, 0, 0}, 1.0f);
  const ScalarField cloud = ball + 0.1f * abs(fractalSum({.octaves = 4, .frequency = 3.0f}));
  const std::pair<const char*, ScalarField> fields[] = {{"sphere", ball}, {"cloud", cloud}};
  for (const auto& [name, field] : fields) {
    double best = 1e30;
    for (int run = 0; run < 7; ++run) {
      const auto start = std::chrono::steady_clock::now();
      parallelFor(kPoints, kPiece, [&](std::size_t begin, std::size_t end) {
        const auto part = [&](const std::vector<float>& lane) {
          return std::span(lane).subspan(begin, end - begin);
        };
        field.eval({part(x), part(y), part(z)}, Spans<1>(std::span(values).subspan(begin, end - begin)));
      });
      best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    }
    std::printf("%s %.6f\n", name, best);
  }
}
