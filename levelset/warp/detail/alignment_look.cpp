#include "nephele/levelset/warp/detail/alignment_look.h"

#include <algorithm>

#include "nephele/modeling/base/random_stream.h"

namespace nephele::detail {

std::vector<Vec3d> surfacePoints(const ExactDistance& shape, int count, std::uint32_t seed) {
  const Mesh& mesh = shape.mesh();
  const AlignmentFrame frame(shape);
  std::vector<double> upTo(mesh.faceCount());
  double area = 0;
  const auto corner = [&](std::size_t t, std::size_t i) {
    return frame.toLocal(mesh.positions[mesh.corners[3 * t + i]]);
  };
  for (std::size_t t = 0; t < upTo.size(); ++t) {
    const Vec3d a = corner(t, 0);
    area += length(cross(corner(t, 1) - a, corner(t, 2) - a));
    upTo[t] = area;
  }
  RandomStream random{seed, std::uint64_t(count)};
  std::vector<Vec3d> points;
  for (int i = 0; i < count; ++i) {
    const double at = (i + random.uniformDouble()) / count * area;
    const auto t = std::size_t(std::lower_bound(upTo.begin(), upTo.end() - 1, at) - upTo.begin());
    const double root = std::sqrt(random.uniformDouble()), second = random.uniformDouble();
    points.push_back(corner(t, 0) * (1 - root) + corner(t, 1) * (root * (1 - second)) +
                     corner(t, 2) * (root * second));
  }
  return points;
}

ceres::Solver::Options solverOptions(int steps) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.max_num_iterations = steps;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  // A share of the cost: where that goes to 0, as between equal shapes, it falls by far more each step.
  options.function_tolerance = 1e-4;
  options.gradient_tolerance = 1e-14;
  options.parameter_tolerance = 1e-10;
  return options;
}

}  // namespace nephele::detail
