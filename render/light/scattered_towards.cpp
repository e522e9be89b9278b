// What scattered light sends towards a viewpoint: k S + (1 - k) L, see scattered_light.cpp. S is the sum of
// the moments in the direction of the eye, L a march from every node away from the eye.
//
// The marcher adds the light that the beam sends to the eye itself, at its own resolution. Of what the beam
// becomes along the line of sight in the solver's medium L may hold only the share that goes on for the peak
// of the phase function, and not the one that stands for thinned cells: for that is what the marcher has
// added.
#include <algorithm>
#include <cmath>
#include <utility>

#include "nephele/levelset/grid/large_buffer.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/render/light/detail/cell_rows.h"
#include "nephele/render/light/detail/harmonics.h"
#include "nephele/render/light/detail/lines_of_sight.h"
#include "nephele/render/light/detail/sending_cells.h"
#include "nephele/render/light/scattered_light.h"

namespace nephele {

namespace {

// Light that this share of what a node sends is behind is not looked for, nor is it behind a tenth of L.
constexpr float kCutoff = 1e-2f, kLargestCutoff = 0.1f;

}  // namespace

// Of a light, with the lights that are seen alike.
struct ScatteredLight::Sender {
  const ScatteredLight& light;

  bool isSeenAs(const ScatteredLight& other) const;
  float sky(const Vec3f& way) const;
  template <class Tell>
  std::vector<float> sources(const Vec3f& eye, bool isPlace, const Tell& tell) const;
  static void send(std::span<const ScatteredLight* const> lights, const Viewpoint& viewpoint,
                   std::span<std::vector<float>* const> sent);
};

// Whether the same is between its nodes and an eye as for another.
bool ScatteredLight::Sender::isSeenAs(const ScatteredLight& other) const {
  if (&light == &other) return true;
  return light.size_ == other.size_ && light.share_ == other.share_ &&
         light.depthPerDensity_ == other.depthPerDensity_ && light.density_ == other.density_;
}

std::vector<std::vector<float>> ScatteredLight::towards(std::span<const ScatteredLight* const> lights,
                                                        const Viewpoint& viewpoint) {
  std::vector<std::vector<float>> sent(lights.size());
  for (std::size_t first = 0; first != lights.size(); ++first) {
    if (!sent[first].empty()) continue;
    std::vector<const ScatteredLight*> alike;
    std::vector<std::vector<float>*> theirs;
    for (std::size_t i = first; i != lights.size() && alike.size() != detail::kLightsTogether; ++i)
      if (sent[i].empty() && Sender{*lights[i]}.isSeenAs(*lights[first]))
        alike.push_back(lights[i]), theirs.push_back(&sent[i]);
    Sender::send(alike, viewpoint, theirs);
  }
  return sent;
}

std::vector<float> ScatteredLight::towards(const Viewpoint& viewpoint) const {
  const ScatteredLight* const one[] = {this};
  return std::move(towards(one, viewpoint).front());
}

// Of lights that are seen alike, as many as go together.
void ScatteredLight::Sender::send(std::span<const ScatteredLight* const> lights, const Viewpoint& viewpoint,
                                  std::span<std::vector<float>* const> sent) {
  const ScatteredLight& any = *lights.front();
  const std::size_t cells = any.density_.size();
  const Vec3f eye = viewpoint.place ? any.worldToLattice_(*viewpoint.place) : Vec3f{},
              forward =
                  viewpoint.forward ? normalize(any.worldToLattice_.linear * *viewpoint.forward) : Vec3f{};
  const auto away = [&](const Vec3f& node) {
    if (!viewpoint.place) return forward;
    const Vec3f way = node - eye;
    // From where the square of the way is beyond a float, nothing is seen.
    const float far = length(way);
    return far > 0 && std::isfinite(far) ? way * (1 / far) : Vec3f{0, 0, 1};
  };
  // What L is made of, and without the beam.
  detail::UnsetVector<detail::Met> met(cells);
  parallelFor(cells, 1 << 14, [&](std::size_t begin, std::size_t end) {
    std::fill(met.begin() + std::ptrdiff_t(begin), met.begin() + std::ptrdiff_t(end), detail::Met{});
  });
  std::vector<std::vector<float>> own;
  for (std::size_t k = 0; k != lights.size(); ++k)
    own.push_back(Sender{*lights[k]}.sources(
        viewpoint.place ? eye : forward, viewpoint.place.has_value(),
        [&](std::size_t i, float itsOwn, float ofBeam) {
          met[i].values[0] = any.density_[i];
          const float goesOn = 1 - any.share_[i];
          met[i].values[1 + k] =
              itsOwn + (goesOn > 0 ? (1 - lights[k]->smoothShare_) / goesOn * ofBeam : 0.0f);
        }));
  for (std::vector<float>* values : sent) values->resize(cells);
  const float leastShare = *std::ranges::min_element(any.share_);
  const detail::SightLattice lattice{any.size_, met.data(), any.depthPerDensity_,
                                     std::min(kCutoff / std::max(1 - leastShare, kCutoff), kLargestCutoff)};
  any.rows_->forEachRow([&](int y, int z, const detail::CellRows::Row& row) {
    detail::LinesOfSight lines;
    for (int x0 = row.begin; x0 < row.end; x0 += detail::LinesOfSight::kCount) {
      const int count = std::min(int(row.end) - x0, detail::LinesOfSight::kCount);
      for (int n = 0; n != count; ++n) {
        const Vec3f node(Vec3i{x0 + n, y, z}), way = away(node);
        for (int axis = 0; axis != 3; ++axis)
          lines.node[axis][n] = node[axis], lines.way[axis][n] = way[axis];
      }
      detail::follow(lattice, count, lines);
      const std::size_t first =
          (std::size_t(z) * std::size_t(any.size_.y) + std::size_t(y)) * std::size_t(any.size_.x) +
          std::size_t(x0);
      for (std::size_t k = 0; k != lights.size(); ++k)
        for (int n = 0; n != count; ++n) {
          const Vec3f way{lines.way[0][n], lines.way[1][n], lines.way[2][n]};
          (*sent[k])[first + std::size_t(n)] =
              lines.sent[k][n] + lines.through[n] * Sender{*lights[k]}.sky(way);
        }
    }
  });
  for (std::size_t k = 0; k != lights.size(); ++k) {
    any.sharpen(own[k]);
    parallelFor(cells, 1 << 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i != end; ++i)
        (*sent[k])[i] = any.share_[i] * own[k][i] + (1 - any.share_[i]) * (*sent[k])[i];
    });
  }
}

// What comes from the sky behind, along a way from the eye.
float ScatteredLight::Sender::sky(const Vec3f& way) const {
  const std::vector<float>& moments = light.sky_;
  if (moments[0] == 0) return 0;
  float y[detail::kMostMoments], sum = 0;
  detail::harmonics(-way, int(light.phase_.size()) - 1, y);
  for (std::size_t m = 0; m != moments.size(); ++m) sum += moments[m] * y[m];
  return std::max(sum, 0.0f);
}

// What nodes send without the beam; calls tell(node, what L is made of there).
template <class Tell>
std::vector<float> ScatteredLight::Sender::sources(const Vec3f& eye, bool isPlace, const Tell& tell) const {
  const int degree = int(light.phase_.size()) - 1;
  float weights[detail::kMostDegree + 1], beamWay[detail::kMostMoments] = {1.0f};
  for (int l = 0; l <= degree; ++l) weights[l] = light.albedo_ * light.phase_[std::size_t(l)];
  if (light.towards_) detail::harmonics(-*light.towards_, degree, beamWay);
  std::vector<float> own(light.beam_.size());
  light.rows_->forEachRow([&](int y, int z, const detail::CellRows::Row& row) {
    detail::SendingCells cells;
    cells.eye = eye;
    cells.isEyeAPlace = isPlace;
    cells.degree = degree;
    cells.weights = weights;
    cells.beamWay = beamWay;
    cells.beamPlace = light.place_ ? &*light.place_ : nullptr;
    const std::size_t first =
        (std::size_t(z) * std::size_t(light.size_.y) + std::size_t(y)) * std::size_t(light.size_.x);
    for (int x = row.begin; x != row.end; x += detail::CellRows::kVector) {
      const std::size_t from = first + std::size_t(x);
      cells.node = Vec3f(Vec3i{x, y, z});
      cells.moments =
          light.moments_.data() + detail::CellRows::momentsAt(std::size_t(row.first + x), light.sky_.size());
      cells.beam = light.beam_.data() + from;
      detail::send(cells);
      for (std::size_t n = 0; n != detail::CellRows::kVector; ++n) {
        own[from + n] = cells.own[n];
        tell(from + n, cells.own[n], cells.ofBeam[n]);
      }
    }
  });
  return own;
}

// Values are means over the density in cells. What is interpolated between nodes has other means: at a
// distance x behind a node, in cells, of -1/2 to 1/2, it is v + x (behind - v) or v - x (before - v), so that
// the mean along an axis is v + (m + c) / 2 (behind - v) + (m - c) / 2 (before - v), where c is the mean of
// x, the centre of the density, and m that of |x|: 1/4, or more where all of it is farther out. What values
// have more than these means is added.
void ScatteredLight::sharpen(std::vector<float>& values) const {
  const std::size_t strides[3] = {1, std::size_t(size_.x), std::size_t(size_.x) * std::size_t(size_.y)};
  std::vector<float> sharp(values);
  rows_->forEachCell([&](std::size_t i, std::size_t, const Vec3f& node) {
    if (!(density_[i] > 0)) return;
    float lacks = 0;
    for (int axis = 0; axis != 3; ++axis) {
      if (node[axis] < 1 || node[axis] > float(size_[axis] - 2)) continue;
      const float centre = centre_[i][axis], away = std::max(0.25f, std::abs(centre));
      lacks += 0.5f * ((away + centre) * (values[i] - values[i + strides[axis]]) +
                       (away - centre) * (values[i] - values[i - strides[axis]]));
    }
    const float least = std::min(0.5f * values[i], 2 * values[i]),
                most = std::max(0.5f * values[i], 2 * values[i]);
    sharp[i] = std::clamp(values[i] + lacks, least, most);
  });
  values = std::move(sharp);
}

}  // namespace nephele
