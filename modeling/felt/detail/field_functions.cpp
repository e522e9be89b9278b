#include "nephele/modeling/felt/detail/functions.h"
#include "nephele/modeling/field/calculus.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"

namespace nephele::felt {

namespace {

using S = ScalarField;
using V = VectorField;
using M = MatrixField;

/// What there is of all three kinds of fields.
template <class T>
void addOfAll(Registry& r, const std::string& type) {
  r.add(type + " compose(" + type + " f, vectorfield map)",
        "`f` read at the places that `map` gives: f(map(x)).",
        "scalarfield moved = compose(sphere((0,0,0), 1), identity() - (1,0,0));",
        [](const T& f, const V& map) { return compose(f, map); });
  r.add(type + " translate(" + type + " f, vector by)", "`f` moved.",
        "scalarfield moved = translate(sphere((0,0,0), 1), (1,0,0));",
        [](const T& f, const Vec3d& by) { return translate(f, toFloat(by)); });
  r.add(type + " rotate(" + type + " f, vector axis, float degrees)",
        "`f` turned about an axis through the origin, right-handed; vectors turn along.",
        "scalarfield turned = rotate(box((0,0,0), (2,1,1)), (0,0,1), 30);",
        [](const T& f, const Vec3d& axis, double degrees) {
          return rotate(f, toFloat(axis), radians(finite("degrees", degrees)));
        });
  r.add(type + " scale(" + type + " f, float factor)",
        "`f` enlarged about the origin. Values stay: the distance to the larger shape is factor * scale(f, "
        "factor).",
        "scalarfield large = 2 * scale(sphere((0,0,0), 1), 2);",
        [](const T& f, double factor) { return scale(f, finite("factor", factor)); });
  r.add(type + " memo(" + type + " f)",
        "The same field, evaluated once per block of points however often it occurs. Variables that are read "
        "more than once are remembered without being told.",
        "", [](const T& f) { return memo(f); });
}

}  // namespace

void addFieldFunctions(Registry& r) {
  r.group("fields");
  r.add("vectorfield identity()", "The place itself: the map that moves nothing.",
        "scalarfield r = sqrt(identity() * identity());", [] { return identity(); });
  r.add("vectorfield position()", "The place itself.", "scalarfield height = position().y;",
        [] { return position(); });
  r.add("float eval(scalarfield f, vector point)", "The value of a field at a point.",
        "print(eval(sphere((0,0,0), 1), (0.5,0,0)));",
        [](const S& f, const Vec3d& point) { return static_cast<double>(f(toFloat(point))); });
  r.add("vector eval(vectorfield f, vector point)", "The value of a field at a point.",
        "print(eval(identity(), (1,2,3)));",
        [](const V& f, const Vec3d& point) { return toDouble(f(toFloat(point))); });
  r.add("matrix eval(matrixfield f, vector point)", "The value of a field at a point.",
        "print(eval(grad(identity()), (1,2,3)));",
        [](const M& f, const Vec3d& point) { return f(toFloat(point)); });
  r.add("vectorfield grad(scalarfield f)",
        "Gradient: exact for expressions, differences at the cell for caches.",
        "vectorfield normal = -grad(sphere((0,0,0), 1));", [](const S& f) { return grad(f); });
  r.add("matrixfield grad(vectorfield f)", "Jacobian: row i is the gradient of component i.",
        "matrixfield one = grad(identity());", [](const V& f) { return grad(f); });
  r.add("scalarfield div(vectorfield f)", "Divergence.", "scalarfield three = div(identity());",
        [](const V& f) { return div(f); });
  r.add("vectorfield curl(vectorfield f)", "Curl.", "vectorfield spin = curl(cross((0,1,0), identity()));",
        [](const V& f) { return curl(f); });
  r.add("scalarfield mask(scalarfield l)", "1 inside, where `l` is above 0, and 0 outside.",
        "scalarfield density = mask(sphere((0,0,0), 1));", [](const S& l) { return mask(l); });
  r.add("scalarfield mask(scalarfield l, float thickness)",
        "1 inside and 0 outside with an edge that is `thickness` world units wide.",
        "scalarfield density = mask(sphere((0,0,0), 1), 0.1);",
        [](const S& l, double thickness) { return mask(l, finite("thickness", thickness)); });
  addOfAll<S>(r, "scalarfield");
  addOfAll<V>(r, "vectorfield");
  addOfAll<M>(r, "matrixfield");
}

}  // namespace nephele::felt
