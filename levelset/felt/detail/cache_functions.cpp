#include "nephele/levelset/felt/detail/functions.h"
#include "nephele/levelset/felt/domain_samples.h"

namespace nephele::felt {

namespace {

template <class T>
void write(const Context& context, Cache<T>& cache, const Field<T>& field) {
  cache.values = sampled(field, cache.domain, context);
}

/// What there is of all three kinds of caches.
template <class T>
void addOfKind(Registry& r, const std::string& kind, const std::string& field) {
  using Held = std::shared_ptr<Cache<T>>;
  r.add("void cachewrite(" + kind + "cache cache, " + kind + "field f)",
        "Samples `f` at the corners of all cells of the cache's domain. The field may read what was in the "
        "cache before; fields that were read from it keep what they had.",
        kind + "cache c(domain((-1,-1,-1), (2,2,2), 0.1)); cachewrite(c, " + field + ");",
        [](Context& context, const Held& cache, const Field<T>& f) { write(context, *cache, f); });
  r.add(kind + "field cacheread(" + kind + "cache cache)",
        "What was written to the cache last, as a field: linear between samples, and outside the domain the "
        "value of the nearest point of its border, so that a fluid loses nothing there. Its gradient is made "
        "of differences over two and four cells, and does not see the border.",
        kind + "cache c(domain((-1,-1,-1), (2,2,2), 0.1)); cachewrite(c, " + field + "); " + kind +
            "field f = cacheread(c);",
        [](const Held& cache) { return samplesOf(*cache); });
  r.add(kind + "field bake(" + kind + "field f, domain box)",
        "`f` sampled at the corners of all cells of a domain: `cachewrite` and `cacheread` in one.",
        kind + "field fast = bake(" + field + ", domain((-1,-1,-1), (2,2,2), 0.1));",
        [](Context& context, const Field<T>& f, const Domain& domain) { return sampled(f, domain, context); })
      .isSampled = true;
}

}  // namespace

void addCacheFunctions(Registry& r) {
  r.group("caches");
  addOfKind<float>(r, "scalar", "sphere((0,0,0), 1)");
  addOfKind<Vec3f>(r, "vector", "identity()");
  addOfKind<Mat3f>(r, "matrix", "grad(identity())");
}

}  // namespace nephele::felt
