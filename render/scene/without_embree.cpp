// Surfaces in builds without Embree: refused in words.
#include "nephele/modeling/base/error.h"
#include "nephele/render/scene/surfaces.h"

namespace nephele {

namespace {

[[noreturn]] void refuse() {
  throw Error("surfaces cannot be rendered: this nephele was built without Embree");
}

}  // namespace

struct Surfaces::Scene {};

Surfaces::Surfaces(std::vector<SurfaceObject>, const Progress&) {
  refuse();
}

Surfaces::~Surfaces() = default;

std::optional<Surfaces::Hit> Surfaces::hit(const Ray&) const {
  refuse();
}

bool Surfaces::occluded(const Ray&, double) const {
  refuse();
}

double Surfaces::distanceToShade(const Ray&) const {
  refuse();
}

std::size_t Surfaces::memoryBytes() const {
  refuse();
}

double Surfaces::estimateBytes(const Mesh&) {
  refuse();
}

}  // namespace nephele
