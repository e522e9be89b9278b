#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "nephele/levelset/cloud/layers_on_grids.h"

namespace nephele {

class PackedGrid;

/// The distance and the layers of the last cloud, for the next one, which takes those that it begins with:
/// where the third layer is another one, the first two stay.
///
/// What a cloud comes to does not depend on what was kept. But layers must reach as far as later ones bring
/// the surface: here they reach farther, in steps of a quarter of their own height, so that a layer is not
/// made again for a slightly higher one after it. A few voxels in a million are others than in a cloud
/// without kept layers. The last layer is not kept, nor are fine ones, see `count`: they take the most
/// memory, and changes before them are likelier. Where others than the last are not kept, the distance, which
/// is soon made beside them, is not either. Nothing of a cloud without keys is kept. For one cloud at a time.
class KeptLayers {
 public:
  /// What the next cloud depends on. Equal keys stand for equal layers.
  struct Keys {
    std::string shape;
    /// Of each layer, beside the shape, the layers before it, and what CloudOptions says in numbers.
    std::vector<std::string> layers;
  };
  void expect(Keys keys) { keys_ = std::move(keys); }

  /// How many layers the last cloud took.
  std::size_t taken() const { return taken_; }
  /// Lets everything go.
  void forget() { *this = {}; }

  /// How many of these layers on a shape in `box` are kept, from the first on: never the last, and none from
  /// the first on whose grid could have more than 4096 bricks in the box.
  static std::size_t count(const std::vector<CumuloLayer>& layers, const Box& box, float voxelSize);
  /// How far layers reach where so many are kept: `layers[index]` and those after it.
  static float reach(const std::vector<CumuloLayer>& layers, std::size_t index, float voxelSize,
                     std::size_t count);
  /// Whether the first of these layers is left out where those after it are low, and so depends on their
  /// amplitudes: where one of them vanishes somewhere, since that saves much.
  static bool areLaterAsked(std::span<const CumuloLayer> layers);

  /// The distance that is there under the key of the shape and these numbers, or what `make` returns, which
  /// stays for the next cloud if it `isKept`. Where they are others than before, all layers are let go first.
  ScalarField distance(const std::string& numbers, bool isKept, const std::function<ScalarField()>& make);

  /// A finished layer: its displacement, and the l_i that the next one reads, sampled, or a distance of its
  /// own where it was turned into one.
  struct Layer {
    std::shared_ptr<PackedGrid> displacement, level{};
    std::optional<ScalarField> renormalised{};
    CumuloLayerReport report{};
  };
  /// The layer of a step that is there under its key, those of the layers before, and these numbers; or null.
  /// One of another key is let go, with all after it. @throws Error if there is no key for each layer.
  const Layer* find(const CumuloStep& step, const std::vector<CumuloLayer>& layers,
                    const std::string& numbers);
  /// Keeps the layer that was not found last, after those before it.
  void keep(Layer layer);

 private:
  std::string keyOf(const CumuloStep& step, const std::vector<CumuloLayer>& layers,
                    const std::string& numbers) const;

  Keys keys_;
  std::string distanceKey_, wanted_;
  std::optional<ScalarField> distance_;
  std::vector<std::string> layerKeys_;
  std::vector<Layer> layers_;
  std::size_t taken_ = 0;
};

}  // namespace nephele
