#pragma once

#include <Eigen/CholmodSupport>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "nephele/levelset/mesh/exact_distance.h"
#include "nephele/levelset/warp/detail/relaxation_energy.h"
#include "nephele/levelset/warp/surface_relaxation.h"

/// One run of relaxation, of all of an object or of a part of it. See surface_relaxation.cpp.
namespace nephele::detail {

/// How many triangles or images one task handles.
inline constexpr std::size_t kRelaxationGrain = 512;

/// Unit normals of a reference, smooth across edges.
class SmoothNormals {
 public:
  explicit SmoothNormals(const ExactDistance& reference);
  Vec3d at(const ExactDistance::Hit& hit) const;

 private:
  const Vec3d& corner(std::size_t t, std::size_t i) const {
    return reference_.mesh().positions[reference_.mesh().corners[3 * t + i]];
  }
  const ExactDistance& reference_;
  std::vector<Vec3d> normals_;
};

/// At what length the image of a side is torn: at 4.5 times the side, or less where triangles are small.
double tornLength(const ExactDistance& reference, double restLength);

/// Two directions that span the plane across `n`.
struct Tangents {
  Vec3d u, v;
  explicit Tangents(const Vec3d& n) {
    const Vec3d other = std::abs(n.x) < 0.6 ? Vec3d(1, 0, 0) : Vec3d(0, 1, 0);
    u = normalize(cross(n, other));
    v = cross(n, u);
    if (u == Vec3d{}) {
      u = {1, 0, 0};
      v = {0, 1, 0};
    }
  }
};

struct RelaxedTriangle {
  std::array<std::uint32_t, 3> vertex;
  /// Gradients of the corners' weights in the plane of the triangle at rest.
  std::array<Eigen::Vector2d, 3> gradient;
  double area;  ///< Share of the whole.
  std::uint32_t face;
  /// Of each side, from corner i to the next: 1 / the square of the length from which its image resists.
  std::array<double, 3> perTear;
};

/// Images and what belongs to them.
struct RelaxationState {
  std::vector<Vec3d> x, normal;
};

/// Triangles of the object, and the images of their corners while these are relaxed.
class Relaxation {
 public:
  /// All of the object.
  Relaxation(const ExactDistance& reference, const SmoothNormals& normals, const Mesh& object,
             const Progress& progress)
      : Relaxation(reference, normals, object, std::vector<std::uint8_t>(object.positions.size(), 1),
                   progress) {}
  /// The triangles that have a corner that `moves`; their other corners stay. Coincident positions agree.
  Relaxation(const ExactDistance& reference, const SmoothNormals& normals, const Mesh& object,
             const std::vector<std::uint8_t>& moves, const Progress& progress);

  /// `images` of all positions, the same count as the object's; those that move are replaced.
  void relax(std::span<Vec3d> images, const RelaxationOptions& options, const Progress& progress);

  /// Faces, of those that have a corner that moves, whose images are turned over or have collapsed.
  std::vector<std::uint32_t> foldedFaces(std::span<const Vec3d> images);

 private:
  static constexpr std::uint32_t kNone = ~0u;

  void run(const RelaxationOptions& options, const Progress& progress);
  void place(std::span<const Vec3d> images);
  /// Goes along the Newton step, halved until the energy falls; returns the energy.
  double descend(const RelaxationEnergy& energy, double before);
  void project(RelaxationState& state) const;
  double total(const RelaxationState& state, const RelaxationEnergy& energy) const;
  RelaxationState moveBy(const Eigen::VectorXd& step, double alpha) const;

  static Vec3d normalOf(const RelaxationState& state, const RelaxedTriangle& t) {
    return normalize(state.normal[t.vertex[0]] + state.normal[t.vertex[1]] + state.normal[t.vertex[2]]);
  }
  static Eigen::Matrix2d jacobian(const RelaxationState& state, const RelaxedTriangle& t);
  static Vec3d side(const RelaxationState& state, const RelaxedTriangle& t, std::size_t i) {
    return state.x[t.vertex[(i + 1) % 3]] - state.x[t.vertex[i]];
  }
  /// The square of a side over that from which it resists.
  static double tearing(const RelaxationState& state, const RelaxedTriangle& t, std::size_t i) {
    const Vec3d e = side(state, t, i);
    return dot(e, e) * t.perTear[i];
  }

  // The linear system of a Newton step, in relaxation_system.cpp.
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  void buildPattern(const Progress& progress);
  /// Gradient and Hessian, the latter without its negative directions.
  void assemble(const RelaxationEnergy& energy);
  /// Gradient and lower half of the Hessian of one triangle by the six coordinates of its corners.
  void localTerms(const RelaxedTriangle& t, const RelaxationEnergy& energy,
                  std::array<double, 27>& out) const;
  /// Adds what side `i` resists with; as for all terms, the Hessian without its negative directions.
  void addTear(const RelaxedTriangle& t, std::size_t i, const RelaxationEnergy& energy, Vector6& gradient,
               Matrix6& hessian) const;
  Eigen::VectorXd solve();

  const ExactDistance& reference_;
  const SmoothNormals& normals_;
  /// By position of the object: its place in the state, if it is in there.
  std::vector<std::uint32_t> indexOf_;
  std::vector<std::uint8_t> isFixed_;
  std::vector<RelaxedTriangle> triangles_;
  RelaxationState state_;
  Eigen::SparseMatrix<double> matrix_;
  std::vector<int> place_;
  Eigen::VectorXd gradient_;
  Eigen::CholmodSupernodalLLT<Eigen::SparseMatrix<double>, Eigen::Lower> solver_;
};

}  // namespace nephele::detail
