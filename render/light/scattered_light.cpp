// Multiple scattering by discrete ordinates: light is swept through a lattice in a few directions
// (LightSweep), scattered by the low moments of the phase function, until it does not change any more
// (TransportSolver).
//
// What the solver does not resolve - the forward peak, and cells so deep that all that is seen of them lies
// behind their face - counts as not scattered at all: the medium's extinction s becomes k s. Along a line of
// sight that is
//
//   dL/ds = -k s (L - S)  =  -s (L - (k S + (1 - k) L)),
//
// so what the marcher, which knows s only, has to add up is k S + (1 - k) L, with L the light that already
// goes towards the eye (scattered_towards.cpp).
//
// Source: discrete ordinates and short characteristics are textbook transport (Lewis and Miller,
// "Computational Methods of Neutron Transport", 1984).
//
// Limits: where light ends within a cell, as at the rim of a cloud, some of it spreads into the air beside
// it; what two lattices differ by tells how much, and half of that is taken back. Details smaller than a cell
// are lit as the cell is. Thinned cells let out more light that was scattered once than the real ones do,
// which the marcher adds: in wisps that are thinned deeply it lacks in what was scattered more often.
#include "nephele/render/light/scattered_light.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/render/light/detail/beam_samples.h"
#include "nephele/render/light/detail/cell_rows.h"
#include "nephele/render/light/detail/harmonics.h"
#include "nephele/render/light/detail/lattice_point.h"
#include "nephele/render/light/detail/scattering_lattice.h"
#include "nephele/render/light/detail/transport_solver.h"

namespace nephele {

namespace {

// Typical optical depth of a cell, beyond which it is thinned.
constexpr float kDeepestCell = 2.0f;
// Where cells are so many times as deep, they are smaller by this.
constexpr float kFinerBeyond = 2.0f, kFiner = 1.3f;
// Below this depth of a cell most of what is sent on is seen before it is scattered again. At four times
// that, all directions are no better.
constexpr float kThinCell = 0.5f;
constexpr int kMostOrder = 8;
// Moments below this are not worth a degree.
constexpr float kSmallMoment = 0.1f;

// Of the moments that so many directions can tell apart.
int mostDegree(int order) {
  return order == 4 ? 2 : order == 6 ? 3 : detail::kMostDegree;
}

void check(const Scattering& scattering, const ScatteredLight::Options& options) {
  require(options.longestSide >= 8 && options.sweeps >= 1,
          "scattered light: needs at least 8 nodes and a sweep");
  require(options.order == 4 || options.order == 6 || options.order == 8,
          fmt::format("scattered light: expected directions of order 4, 6 or 8, got {}", options.order));
  require(
      std::isfinite(scattering.extinction) && scattering.extinction >= 0 && scattering.albedo >= 0 &&
          scattering.albedo <= 1 && !scattering.phase.empty(),
      fmt::format("scattered light: expected an extinction >= 0, an albedo within [0, 1] and moments of a "
                  "phase function, got {}, {} and {} moments",
                  scattering.extinction, scattering.albedo, scattering.phase.size()));
}

}  // namespace

int ScatteredLight::Options::degree(const std::vector<float>& phase) const {
  const int most = mostDegree(order);
  int degree = 0;
  while (degree < most && std::size_t(degree) + 1 < phase.size() &&
         std::fabs(phase[std::size_t(degree) + 1]) > kSmallMoment)
    ++degree;
  return degree;
}

std::vector<Vec3f> ScatteredLight::skyDirections(const RenderVolume& volume, const Options& options) {
  std::vector<Vec3f> towards;
  for (const detail::Ordinate& ordinate : detail::levelSymmetric(options.order))
    towards.push_back(normalize(volume.density().indexToWorld().linear * -ordinate.way));
  return towards;
}

ScatteredLight::ScatteredLight(const RenderVolume& volume, const Scattering& scattering,
                               const ScatteredSource& source, const Options& options,
                               const Progress& progress) {
  check(scattering, options);
  const BrickGrid& grid = volume.density();
  const int degree = options.degree(scattering.phase);
  detail::TransportSolver::Medium medium;
  medium.ordinates = detail::levelSymmetric(options.order);
  medium.inflow.assign(medium.ordinates.size(), 0.0f);
  if (source.sky) medium.inflow = source.sky(skyDirections(volume, options));
  sky_.assign(std::size_t(detail::momentCount(degree)), 0.0f);
  for (std::size_t i = 0; i != medium.ordinates.size(); ++i) {
    float y[detail::kMostMoments];
    detail::harmonics(medium.ordinates[i].way, degree, y);
    for (std::size_t m = 0; m != sky_.size(); ++m)
      sky_[m] += medium.ordinates[i].weight * medium.inflow[i] * y[m];
  }
  size_ = {detail::CellRows::kVector, 1, 1};
  rows_ = std::make_shared<const detail::CellRows>(size_, std::vector<std::uint8_t>(std::size_t(size_.x), 1));
  for (const float moment : sky_) moments_.insert(moments_.end(), std::size_t(size_.x), moment);
  beam_ = density_ = std::vector<float>(std::size_t(size_.x));
  centre_.resize(beam_.size());
  share_.assign(std::size_t(size_.x), 1.0f);
  if (volume.isEmpty()) return;

  const SmoothScattering smooth(scattering.phase, scattering.albedo, degree);
  albedo_ = smooth.albedo;
  phase_ = smooth.moments;
  const detail::LatticePlacement place(volume, options.longestSide);
  detail::ScatteringLattice lattice = place.lattice();
  detail::sampleDensity(volume, place, INFINITY, lattice);
  const float perDensity = scattering.extinction * smooth.share * grid.voxelSize() * place.voxelsPerCell(),
              deepest = perDensity * detail::typicalDensity(lattice);
  smoothShare_ = smooth.share;
  // Of cells of the thinned density, and what is too dense of the volume's own.
  float share = smooth.share, most = INFINITY;
  std::optional<detail::ScatteringLattice> whole;
  ScatteredSource beam = source;
  std::shared_ptr<const LightVolume> thinned;
  if (deepest > kDeepestCell && source.columns && !source.thinned) {
    share *= kDeepestCell / deepest;
  } else if (deepest > kDeepestCell) {
    most = kDeepestCell / perDensity;
    whole = lattice;
    detail::sampleDensity(volume, place, most, lattice);
    if (source.thinned) {
      thinned = source.thinned(most, detail::kDarkDepth / (scattering.extinction * share * source.shadow));
      beam.setColumns(*thinned);
    }
  }
  detail::sampleBeam(volume, place, beam, scattering.extinction * share, most, lattice);
  thinned.reset();
  if (source.glow)
    for (float& value : lattice.beam) value /= share * std::max(albedo_, 1e-6f);
  for (int i = 0; i != place.halvings; ++i) {
    lattice = detail::halved(lattice);
    if (whole) whole = detail::halved(*whole);
  }
  size_ = lattice.size;
  share_.assign(lattice.density.size(), share);
  if (whole) {
    for (std::size_t i = 0; i != share_.size(); ++i)
      if (whole->density[i] > 0) share_[i] *= std::min(lattice.density[i] / whole->density[i], 1.0f);
    growShares(whole->density);
    whole.reset();
  }
  const float scale = 1 / lattice.voxels;
  const Vec3f middle =
      Vec3f(place.firstBrick * BrickGrid::kBrick) + Vec3f{1, 1, 1} * (0.5f * (lattice.voxels - 1));
  worldToLattice_ = {Mat3f::scaling(scale) * grid.worldToIndex().linear,
                     (grid.worldToIndex().translation - middle) * scale};
  depthPerDensity_ = scattering.extinction * share * grid.voxelSize() * lattice.voxels;
  if (source.towards) towards_ = normalize(worldToLattice_.linear * *source.towards);
  if (source.place) place_ = worldToLattice_(*source.place);

  medium.extinction = depthPerDensity_;
  medium.phase = phase_;
  for (float& value : medium.phase) value *= albedo_;
  const float finest = lattice.voxels;
  detail::TransportSolver solver(std::move(lattice), std::move(medium));
  moments_ = solver.solve(
      sky_,
      [&](const detail::ScatteringLattice& level, const detail::CellRows& rows, detail::Moments& light) {
        addBeam(light, level, rows, level.voxels / finest);
      },
      {options.sweeps, options.tolerance}, progress);
  sweeps_ = solver.sweeps();
  residual_ = solver.residual();
  rows_ = std::make_shared<const detail::CellRows>(std::move(solver.finestRows()));
  beam_ = std::move(solver.finest().beam);
  density_ = std::move(solver.finest().density);
  centre_ = std::move(solver.finest().centre);
}

// Light is read between cells, so those that hold nothing have the share of those that do around them.
void ScatteredLight::growShares(const std::vector<float>& density) {
  const std::size_t row = std::size_t(size_.x), slice = row * std::size_t(size_.y);
  const std::vector<float> shares = share_;
  parallelFor(std::size_t(std::max(size_.z - 2, 0)), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t z = begin + 1; z != end + 1; ++z)
      for (std::size_t y = 1; y + 1 < std::size_t(size_.y); ++y)
        for (std::size_t x = 1; x + 1 < row; ++x) {
          const std::size_t i = z * slice + y * row + x;
          if (density[i] > 0) continue;
          float sum = 0, weights = 0;
          for (std::size_t k = i - slice; k <= i + slice; k += slice)
            for (std::size_t j = k - row; j <= k + row; j += row)
              for (std::size_t n = j - 1; n != j + 2; ++n)
                sum += density[n] * shares[n], weights += density[n];
          if (weights > 0) share_[i] = sum / weights;
        }
  });
}

Vec3f ScatteredLight::wayOfBeam(const Vec3f& node) const {
  if (towards_) return -*towards_;
  const Vec3f way = node - *place_;
  const float far = length(way);
  return far > 0 ? way * (1 / far) : Vec3f{0, 0, 1};
}

// Adds the moments of the beam to those of a lattice whose cells are so many times wider.
void ScatteredLight::addBeam(detail::Moments& moments, const detail::ScatteringLattice& lattice,
                             const detail::CellRows& rows, float wider) const {
  const std::size_t count = hasWay() ? moments.size() / rows.count() : 1;
  const int degree = int(phase_.size()) - 1;
  rows.forEachRow([&](int y, int z, const detail::CellRows::Row& row) {
    float own[detail::kMostMoments] = {1.0f};
    if (towards_) detail::harmonics(-*towards_, degree, own);
    for (int x = row.begin; x != row.end; ++x) {
      const float beam = lattice.beam[lattice.index(x, y, z)];
      if (beam == 0) continue;
      if (place_) {
        const float half = 0.5f * (wider - 1);
        detail::harmonics(wayOfBeam(Vec3f(Vec3i{x, y, z}) * wider + Vec3f{half, half, half}), degree, own);
      }
      const std::size_t at =
          detail::CellRows::momentsAt(std::size_t(row.first + x), moments.size() / rows.count());
      for (std::size_t m = 0; m != count; ++m) moments[at + m * detail::CellRows::kVector] += own[m] * beam;
    }
  });
}

std::vector<float> ScatteredLight::mean() const {
  std::vector<float> result(beam_.size());
  rows_->forEachCell([&](std::size_t i, std::size_t kept, const Vec3f&) {
    result[i] = moments_[detail::CellRows::momentsAt(kept, sky_.size())] - beam_[i];
  });
  return result;
}

float ScatteredLight::meanAt(const Vec3f& world) const {
  return detail::LatticePoint(size_, worldToLattice_(world)).of(mean().data());
}

ScatteredLight::Options ScatteredLight::Options::suitedTo(const RenderVolume& volume,
                                                          const Scattering& scattering) const {
  Options result = *this;
  if (volume.isEmpty()) return result;
  const SmoothScattering smooth(scattering.phase, scattering.albedo, degree(scattering.phase));
  const float depth = scattering.extinction * smooth.share * volume.density().voxelSize() *
                      detail::LatticePlacement(volume, longestSide).voxelsPerCell() * volume.typicalDensity();
  if (depth > kFinerBeyond * kDeepestCell) result.longestSide = int(kFiner * float(longestSide));
  const std::vector<float>& phase = scattering.phase;
  const std::size_t next = std::size_t(mostDegree(order)) + 1;
  if (depth < kThinCell && next < phase.size() && std::abs(phase[next]) > kSmallMoment)
    result.order = kMostOrder;
  return result;
}

// Cells are typically no denser than voxels.
float ScatteredLight::leastExtinction(const RenderVolume& volume, const Options& options) {
  if (volume.isEmpty()) return 0;
  return kDeepestCell /
         (volume.density().voxelSize() *
          detail::LatticePlacement(volume, options.longestSide).voxelsPerCell() * volume.typicalDensity());
}

ScatteredLight::Bytes ScatteredLight::estimateBytes(const RenderVolume& volume, const Options& options) {
  if (volume.isEmpty()) return {};
  // Of the finer ones that deep cells need; more directions, of thin ones, take less.
  const detail::LatticePlacement place(volume, int(kFiner * float(options.longestSide)));
  const double moments = detail::momentCount(mostDegree(options.order));
  const double sampled = place.sampledCells(), kept = std::pow(0.125, place.halvings), nodes = kept * sampled,
               near = kept * place.sampledCellsNear(volume, detail::TransportSolver::kReach);
  // Moments: the light, swept and turned, what is added up there, and the acceleration's, on all lattices;
  // beside them what the sweeps know of every cell.
  return {(7 * moments + 14) * sizeof(float) * near + 12 * sizeof(float) * sampled,
          moments * sizeof(float) * near + 6 * sizeof(float) * nodes};
}

}  // namespace nephele
