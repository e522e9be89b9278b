#pragma once

#include <memory>
#include <optional>

#include "nephele/render/march/detail/picture.h"
#include "nephele/render/march/integrator.h"

namespace nephele::detail {

/// Marches rays through a lit volume, be its density a grid or a field.
class MarchIntegrator final : public Integrator {
 public:
  /// `light` is null where nothing is to be seen. @throws Error if an option is outside its range.
  MarchIntegrator(std::shared_ptr<const BakedLight> light, const RenderOptions& options);

  static void check(const RenderOptions& options);
  static void check(const Octaves& octaves);

  const char* stage() const override { return "march"; }
  int raysPerPixel() const override { return options_.samples; }
  float faintRadiance() const override;
  bool prepare(const RenderScene& scene, const Film& film, const Progress& progress) override;
  std::unique_ptr<TileWorker> worker() const override;

 private:
  class Worker;

  std::shared_ptr<const BakedLight> light_;
  RenderOptions options_;
  std::optional<Picture> picture_;
};

}  // namespace nephele::detail
