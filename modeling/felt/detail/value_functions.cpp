#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/felt/detail/functions.h"
#include "nephele/modeling/field/operations.h"

namespace nephele::felt {

namespace {

using S = ScalarField;
using V = VectorField;
using M = MatrixField;

Mat3f fromRows(const Vec3d& x, const Vec3d& y, const Vec3d& z) {
  const Vec3f a = toFloat(x), b = toFloat(y), c = toFloat(z);
  return {{a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z}};
}

Domain checkedDomain(const Domain& domain) {
  requireValid(domain);
  return domain;
}

template <class T>
std::shared_ptr<Cache<T>> emptyCache(const Domain& domain) {
  auto cache = std::make_shared<Cache<T>>();
  cache->domain = domain;
  return cache;
}

std::string textOf(const Call& call, const char* separator) {
  std::string text;
  for (std::size_t i = 0; i < call.arguments.size(); ++i) {
    if (i != 0) text += separator;
    text += shown(call.arguments[i], call.types[i]);
  }
  return text;
}

void addPlain(Registry& r) {
  r.addGeneral("void print(...)", "Shows its arguments, separated by spaces, and ends the line.",
               "print(\"gain\", 1.5);", [](Call& call) -> Value {
                 if (call.context.print) call.context.print(textOf(call, " "));
                 return {};
               });
  r.addGeneral("string string(any value)", "What `print` would show.", "print(\"layer \" + string(3));",
               [](Call& call) -> Value { return textOf(call, ""); });
  r.addGeneral(
      "int size(any[] array)", "How many elements an array has.", "print(size([1, 2, 3]));",
      [](Call& call) -> Value { return static_cast<std::int64_t>(call.arguments[0].as<Array>()->size()); });
  r.add("int size(string text)", "How many bytes a string has.", "print(size(\"cloud\"));",
        [](const std::string& text) { return static_cast<std::int64_t>(text.size()); });
  r.add("void error(string message)", "Ends the script with a message.",
        "if (1 > 2) error(\"one is above two\");",
        [](const std::string& message) { throw CallError(Code::failed, printable(message, 1000)); });
  r.add("int int(int value)", "The value itself.", "print(int(2));",
        [](std::int64_t value) { return value; });
  r.add("int int(float value)", "Without what is after the point.", "print(int(2.7));", [](double value) {
    if (!(std::abs(value) < 9.2e18))
      throw CallError(Code::overflow, shown(value, {Kind::number}) + " is no integer of 64 bits");
    return static_cast<std::int64_t>(value);
  });
  r.add("float float(float value)", "A number.", "print(float(1) / 2);", [](double value) { return value; });
  r.add("vector vector(float x, float y, float z)", "A vector, which is also written (x, y, z).",
        "vector up = vector(0, 1, 0);", [](double x, double y, double z) {
          return Vec3d{x, y, z};
        });
  r.add("vector vector(vector value)", "The vector itself.", "", [](const Vec3d& value) { return value; });
  r.add("matrix matrix(vector row0, vector row1, vector row2)",
        "The matrix with these rows, which is also written (row0, row1, row2).",
        "matrix m = ((1,0,0), (0,1,0), (0,0,1));",
        [](const Vec3d& x, const Vec3d& y, const Vec3d& z) { return fromRows(x, y, z); });
}

void addConversions(Registry& r) {
  r.add("scalarfield scalarfield(scalarfield value)",
        "A field; a number becomes one that is the same everywhere.", "scalarfield one = scalarfield(1.0);",
        [](const S& value) { return value; });
  r.add("vectorfield vectorfield(vectorfield value)",
        "A field; a vector becomes one that is the same everywhere.",
        "vectorfield up = vectorfield((0,1,0));", [](const V& value) { return value; });
  r.add("vectorfield vectorfield(scalarfield x, scalarfield y, scalarfield z)",
        "The field with these components, which is also written (x, y, z).",
        "vectorfield flat = (identity().x, 0, identity().z);",
        [](const S& x, const S& y, const S& z) { return vectorField(x, y, z); });
  r.add("matrixfield matrixfield(matrixfield value)",
        "A field; a matrix becomes one that is the same everywhere.", "",
        [](const M& value) { return value; });
  r.add("matrixfield matrixfield(vectorfield row0, vectorfield row1, vectorfield row2)",
        "The field with these rows, which is also written (row0, row1, row2).", "",
        [](const V& x, const V& y, const V& z) { return matrixField(x, y, z); });
}

void addDomains(Registry& r) {
  r.group("domains and caches");
  r.add(
      "domain domain(vector origin, vector lengths, vector rotation, float cellX, float cellY, float cellZ)",
      "A box with cells: its corner, its edges, a turn about the direction of `rotation` by its length in "
      "radians, and the edges of a cell. Cells keep their size: where an edge is no multiple of theirs, the "
      "last ones, and with them samples, walls and periods, reach beyond it.",
      "domain d((-1,-1,-1), (2,2,2), (0,0,0), 0.1, 0.1, 0.1);",
      [](const Vec3d& origin, const Vec3d& lengths, const Vec3d& rotation, double x, double y, double z) {
        return checkedDomain({origin, lengths, rotation, {x, y, z}});
      });
  r.add("domain domain(vector origin, vector lengths, float cell)",
        "A box along the axes with cubes for cells.", "domain d((-1,-1,-1), (2,2,2), 0.1);",
        [](const Vec3d& origin, const Vec3d& lengths, double cell) {
          return checkedDomain({origin, lengths, {}, {cell, cell, cell}});
        });
  r.add("domain domain(domain value)", "The domain itself.", "", [](const Domain& value) { return value; });
  r.add("scalarcache scalarcache(domain box)", "Room for the samples of a scalar field.",
        "domain d((-1,-1,-1), (2,2,2), 0.1);\nscalarcache c(d);",
        [](const Domain& box) { return emptyCache<float>(box); });
  r.add("vectorcache vectorcache(domain box)", "Room for the samples of a vector field.",
        "domain d((-1,-1,-1), (2,2,2), 0.1);\nvectorcache c(d);",
        [](const Domain& box) { return emptyCache<Vec3f>(box); });
  r.add("matrixcache matrixcache(domain box)", "Room for the samples of a matrix field.",
        "domain d((-1,-1,-1), (2,2,2), 0.1);\nmatrixcache c(d);",
        [](const Domain& box) { return emptyCache<Mat3f>(box); });
}

}  // namespace

void addValueFunctions(Registry& r) {
  r.group("values");
  addPlain(r);
  addConversions(r);
  addDomains(r);
}

}  // namespace nephele::felt
