// What scattered light sends towards a viewpoint: k S + (1 - k) L, see scattered_light.cpp. S is the sum of
// the moments in the direction of the eye, L a march from every node away from the eye.
//
// The marcher adds the light that the beam sends to the eye itself, at its own resolution. Of what the beam
// becomes along the line of sight in the solver's medium L may hold only the share that goes on for the peak
// of the phase function, and not the one that stands for thinned cells: for that is what the marcher has
// added.
#include <algorithm>
#include <cmath>

#include "nephele/modeling/base/parallel.h"
#include "nephele/render/light/detail/cell_rows.h"
#include "nephele/render/light/detail/harmonics.h"
#include "nephele/render/light/detail/lattice_point.h"
#include "nephele/render/light/exp_of_minus.h"
#include "nephele/render/light/scattered_light.h"

namespace nephele {

namespace {

// Light that this share of what a node sends is behind is not looked for, nor is it behind a tenth of L.
// Steps grow this often, after so many of them.
constexpr float kCutoff = 1e-2f, kLargestCutoff = 0.1f;
constexpr int kStepsOfALength = 4, kLongestStep = 4;

// What light meets at a place.
struct Met {
  float density, source;

  Met operator+(const Met& b) const { return {density + b.density, source + b.source}; }
  Met operator-(const Met& b) const { return {density - b.density, source - b.source}; }
  Met operator*(float x) const { return {density * x, source * x}; }
};

// Light that goes along a line, near to far: sources are linear in depth between two places.
struct LineOfSight {
  Met met;
  float sum = 0, through = 1;

  void step(float length, float depthPerDensity, Met next) {
    // Far from density nothing is known of the source.
    if (!(next.density > 0)) next.source = met.source;
    const float depth = std::min(0.5f * length * depthPerDensity * (met.density + next.density), 80.0f),
                left = detail::expOfMinus(depth);
    const float mean = depth < 0.03f ? 1 - depth * (0.5f - depth * (1.0f / 6)) : (1 - left) / depth;
    sum += through * (met.source * (1 - mean) + next.source * (mean - left));
    through *= left;
    met = next;
  }
};

}  // namespace

std::vector<float> ScatteredLight::towards(const Viewpoint& viewpoint) const {
  const std::size_t cells = beam_.size();
  const int degree = int(phase_.size()) - 1;
  const Vec3f eye = viewpoint.place ? worldToLattice_(*viewpoint.place) : Vec3f{},
              forward = viewpoint.forward ? normalize(worldToLattice_.linear * *viewpoint.forward) : Vec3f{};
  const auto away = [&](const Vec3f& node) {
    if (!viewpoint.place) return forward;
    const Vec3f way = node - eye;
    // From where the square of the way is beyond a float, nothing is seen.
    const float far = length(way);
    return far > 0 && std::isfinite(far) ? way * (1 / far) : Vec3f{0, 0, 1};
  };
  const float ofBeam = share_ < 1 ? (1 - smoothShare_) / (1 - share_) : 0.0f;
  // What L is made of, and without the beam.
  std::vector<Met> met(cells);
  std::vector<float> own(cells);
  float beamWay[detail::kMostMoments] = {};
  if (towards_) detail::harmonics(-*towards_, degree, beamWay);
  rows_->forEachCell([&](std::size_t i, std::size_t kept, const Vec3f& node) {
    float y[detail::kMostMoments], ways[detail::kMostMoments];
    detail::harmonics(-away(node), degree, y);
    const float *way = beamWay, *moments = moments_.data() + detail::CellRows::momentsAt(kept, sky_.size());
    if (place_) detail::harmonics(wayOfBeam(node), degree, ways), way = ways;
    float all = 0, beam = 0;
    for (int l = 0, m = 0; l <= degree; ++l) {
      const float weight = albedo_ * phase_[std::size_t(l)];
      for (; m != detail::momentCount(l); ++m) {
        all += weight * y[m] * moments[m * detail::CellRows::kVector];
        if (m == 0 || hasWay()) beam += weight * y[m] * (m == 0 ? 1.0f : way[m]);
      }
    }
    own[i] = all - beam * beam_[i];
    met[i] = {density_[i], own[i] + ofBeam * beam * beam_[i]};
  });
  std::vector<float> sent(cells);
  const float cutoff = std::min(kCutoff / std::max(1 - share_, kCutoff), kLargestCutoff);
  rows_->forEachCell([&](std::size_t i, std::size_t, const Vec3f& node) {
    const Vec3f way = away(node);
    LineOfSight line{met[i]};
    float at = 0;
    for (int step = 0; line.through > cutoff; ++step) {
      const float length = float(std::min(1 << step / kStepsOfALength, kLongestStep));
      at += length;
      const Vec3f p = node + way * at;
      if (!(p.x > -1 && p.y > -1 && p.z > -1 && p.x < float(size_.x) && p.y < float(size_.y) &&
            p.z < float(size_.z)))
        break;
      line.step(length, depthPerDensity_, detail::LatticePoint(size_, p).of(met.data()));
    }
    float sky = 0;
    if (sky_[0] != 0) {
      float y[detail::kMostMoments];
      detail::harmonics(-way, degree, y);
      for (std::size_t m = 0; m != sky_.size(); ++m) sky += sky_[m] * y[m];
    }
    sent[i] = line.sum + line.through * std::max(sky, 0.0f);
  });
  sharpen(own);
  parallelFor(cells, 1 << 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i != end; ++i) sent[i] = share_ * own[i] + (1 - share_) * sent[i];
  });
  return sent;
}

// Values are means over cells. Interpolated between nodes they would have the mean (v_before + 6 v +
// v_behind) / 8 along every axis: what that lacks is added.
void ScatteredLight::sharpen(std::vector<float>& values) const {
  const std::size_t strides[3] = {1, std::size_t(size_.x), std::size_t(size_.x) * std::size_t(size_.y)};
  std::vector<float> sharp(values.size());
  rows_->forEachCell([&](std::size_t i, std::size_t, const Vec3f& node) {
    float lacks = 0;
    for (int axis = 0; axis != 3; ++axis)
      if (node[axis] >= 1 && node[axis] <= float(size_[axis] - 2))
        lacks += 2 * values[i] - values[i - strides[axis]] - values[i + strides[axis]];
    const float least = std::min(0.5f * values[i], 2 * values[i]),
                most = std::max(0.5f * values[i], 2 * values[i]);
    sharp[i] = std::clamp(values[i] + 0.125f * lacks, least, most);
  });
  values = std::move(sharp);
}

}  // namespace nephele
