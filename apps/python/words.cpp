// The words of Felt in Python: what a script may call, under the same names and with the same parameters. A
// call is an expression of Felt whose names are given the values of Python, so that there is one list of
// functions, one way to choose among those of a name, and one sentence for each fault.
#include <pybind11/functional.h>
#include <pybind11/stl.h>

#include "apps/options/expression_names.h"
#include "apps/python/values.h"
#include "apps/python/watch.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/nearest_name.h"
#include "nephele/modeling/felt/program.h"

namespace nephele::python {
namespace {

using felt::Kind;
using felt::Type;
using felt::Value;
using pybind11::literals::operator""_a;

/// A value with its type, as expressions are given it.
struct Typed {
  Type type;
  Value value;
};

/// What Python objects become. A list of three numbers is a vector, or an array where a function takes one.
struct Conversion {
  bool listsAreArrays = false;
  bool sawSuchList = false;
  std::optional<double> longestSide{};

  Typed operator()(const py::handle& object, const std::string& what);
  Typed array(const py::sequence& sequence, const std::string& what);
};

bool isNumber(const py::handle& object) {
  return PyFloat_Check(object.ptr()) || PyIndex_Check(object.ptr()) ||
         (!PySequence_Check(object.ptr()) && PyNumber_Check(object.ptr()));
}

bool isTripleOfNumbers(const py::handle& object) {
  if (!PySequence_Check(object.ptr()) || py::isinstance<py::str>(object) ||
      PySequence_Size(object.ptr()) != 3)
    return false;
  for (const py::handle& item : py::reinterpret_borrow<py::sequence>(object))
    if (!isNumber(item)) return false;
  return true;
}

bool hasFields(const py::sequence& sequence) {
  for (const py::handle& item : sequence)
    if (py::isinstance<PythonScalarField>(item) || py::isinstance<PythonVectorField>(item)) return true;
  return false;
}

Value evaluatedWith(const std::string& expression, const std::vector<felt::Given>& given, const Watch& watch,
                    std::optional<double> longestSide) {
  felt::Context context{.longestSide = longestSide, .progress = &watch};
  return felt::ExpressionText("nephele", expression, {}, apps::feltFunctions(), given).evaluate(context);
}

template <class T>
bool takeField(const py::handle& object, Kind kind, Typed& typed) {
  if (!py::isinstance<PythonField<T>>(object)) return false;
  typed = {{kind}, object.cast<const PythonField<T>&>().value};
  return true;
}

Typed Conversion::array(const py::sequence& sequence, const std::string& what) {
  auto values = std::make_shared<std::vector<Value>>();
  std::vector<Typed> items;
  Type element;
  for (const py::handle& item : sequence) {
    items.push_back((*this)(item, what));
    const Type& type = items.back().type;
    if (items.size() == 1 || conversionCost(element, type))
      element = type;
    else if (!conversionCost(type, element))
      throw py::type_error(what + ": a list needs values of one kind, got " + articledName(element) +
                           " and " + articledName(type));
  }
  // No function takes whole numbers alone.
  if (items.empty() || element.kind == Kind::integer) element = {Kind::number};
  for (const Typed& item : items)
    values->push_back(item.type == element ? item.value : converted(item.value, element));
  return {{element.kind, true}, felt::Array(std::move(values))};
}

Typed Conversion::operator()(const py::handle& object, const std::string& what) {
  Typed typed;
  if (takeField<float>(object, Kind::scalarField, typed) ||
      takeField<Vec3f>(object, Kind::vectorField, typed) ||
      takeField<Mat3f>(object, Kind::matrixField, typed))
    return typed;
  if (py::isinstance<py::bool_>(object)) return {{Kind::boolean}, object.cast<bool>()};
  if (py::isinstance<py::str>(object)) return {{Kind::text}, object.cast<std::string>()};
  if (py::isinstance<felt::Domain>(object)) return {{Kind::domain}, object.cast<const felt::Domain&>()};
  if (py::isinstance<felt::Shape>(object)) {
    const auto mesh = object.cast<std::shared_ptr<felt::Shape>>();
    if (!longestSide) longestSide = double(boundingBox(mesh->mesh).longestSide());
    return {{Kind::shape}, PythonMesh(mesh)};
  }
  if (py::isinstance<py::array>(object)) {
    const auto array = py::reinterpret_borrow<py::array>(object);
    if (array.ndim() == 0) return (*this)(array.attr("item")(), what);
    if (array.ndim() == 2 && array.shape(0) == 3 && array.shape(1) == 3) {
      const Packed<float> numbers = packedFrom<float>(array, what);
      Mat3f matrix;
      std::copy_n(numbers.data(), 9, matrix.m.begin());
      return {{Kind::matrix}, matrix};
    }
    if (array.ndim() != 1) throw py::value_error(what + ": a vector has 3 numbers, got " + shapeText(array));
    if (array.shape(0) == 3) return {{Kind::vector}, vectorFrom(object, what)};
    return this->array(array.attr("tolist")(), what);
  }
  if (PySequence_Check(object.ptr())) {
    const auto sequence = py::reinterpret_borrow<py::sequence>(object);
    const bool isList = py::isinstance<py::list>(object);
    if (isTripleOfNumbers(object) && !(isList && listsAreArrays)) {
      sawSuchList |= isList;
      return {{Kind::vector}, vectorFrom(object, what)};
    }
    if (py::isinstance<py::tuple>(object) && sequence.size() == 3) {
      if (hasFields(sequence)) {
        std::vector<felt::Given> given;
        for (std::size_t i = 0; i < 3; ++i) {
          Typed part = (*this)(sequence[i], what);
          given.push_back({std::string(1, char('a' + i)), part.type, part.value});
        }
        const Value value = evaluatedWith("(a, b, c)", given, Watch(), {});
        return {{value.is<VectorField>() ? Kind::vectorField : Kind::matrixField}, value};
      }
      if (isTripleOfNumbers(sequence[0]) && isTripleOfNumbers(sequence[1]) && isTripleOfNumbers(sequence[2]))
        return (*this)(py::array::ensure(object), what);
    }
    return array(sequence, what);
  }
  if (PyIndex_Check(object.ptr())) {
    const auto whole = py::reinterpret_steal<py::object>(PyNumber_Index(object.ptr()));
    if (!whole) throw py::error_already_set();
    int overflow = 0;
    const long long number = PyLong_AsLongLongAndOverflow(whole.ptr(), &overflow);
    if (overflow != 0) throw py::value_error(what + ": is no integer of 64 bits");
    return {{Kind::integer}, std::int64_t(number)};
  }
  if (isNumber(object) && PyObject_HasAttrString(object.ptr(), "__float__") &&
      !PyObject_HasAttrString(object.ptr(), "imag_"))
    if (const double number = PyFloat_AsDouble(object.ptr()); !PyErr_Occurred())
      return {{Kind::number}, number};
  PyErr_Clear();
  throw py::type_error(
      what + ": cannot be a " + std::string(py::str(py::type::of(object).attr("__name__"))) +
      (py::isinstance<py::function>(object) ? "; nephele.field(function) makes a field of it" : ""));
}

/// The first fault, as Python tells it.
[[noreturn]] void rethrow(const felt::ScriptError& error, const std::string& who) {
  const felt::Diagnostic& fault = error.diagnostics().front();
  using felt::Code;
  std::string text = fault.message;
  if (!fault.hint.empty()) text += "; " + fault.hint;
  for (const Code code : {Code::noSuchCall, Code::ambiguousCall, Code::wrongType, Code::unknownParameter})
    if (fault.code == code) throw py::type_error(text);
  throw Error(text.starts_with(who) ? text : who + ": " + text);
}

/// `make` gives the expression of the names a0, a1 ... that the arguments get.
py::object call(const std::string& who, const py::args& arguments, const py::kwargs& named,
                const std::string& expression, bool isQuick) {
  py::object progress = py::none();
  for (const bool listsAreArrays : {false, true}) {
    Conversion convert{listsAreArrays};
    std::vector<felt::Given> given;
    std::string list;
    const auto add = [&](const std::string& prefix, const py::handle& object, const std::string& what) {
      Typed typed = convert(object, what);
      given.push_back({"a" + std::to_string(given.size()), typed.type, std::move(typed.value)});
      list += (list.empty() ? "" : ", ") + prefix + given.back().name;
    };
    for (std::size_t i = 0; i < arguments.size(); ++i)
      add("", arguments[i], who + ": argument " + std::to_string(i + 1));
    for (const auto& [key, object] : named) {
      const auto name = key.cast<std::string>();
      if (name == "progress")
        progress = py::reinterpret_borrow<py::object>(object);
      else
        add(name + " = ", object, who + ": '" + name + "'");
    }
    try {
      Value value;
      Watch watch;
      const auto work = [&] {
        value = evaluatedWith(expression.empty() ? who + "(" + list + ")" : expression, given, watch,
                              convert.longestSide);
      };
      if (isQuick)
        atOnce(watch, work);
      else
        watched(watch, progress, work);
      return toPython(value);
    } catch (const felt::ScriptError& error) {
      const bool mayBeArray =
          convert.sawSuchList && error.diagnostics().front().code == felt::Code::noSuchCall;
      if (!mayBeArray || listsAreArrays) rethrow(error, who);
    }
  }
  return py::none();
}

py::object callOperator(const py::object& a, const py::object& b, const std::string& expression) {
  try {
    return call("operator", py::make_tuple(a, b), {}, expression, true);
  } catch (const py::builtin_exception&) {
    // Python then asks the other operand, and says which types do not go together.
    return py::reinterpret_borrow<py::object>(Py_NotImplemented);
  }
}

template <class T>
void addOperators(py::module_& module, const char* name) {
  auto type = module.attr(name);
  const auto add = [&](const char* method, const std::string& expression) {
    type.attr(method) = py::cpp_function(
        [expression](const py::object& a, const py::object& b) { return callOperator(a, b, expression); },
        py::name(method), py::is_method(type));
  };
  for (const auto& [method, mark] : std::initializer_list<std::pair<const char*, const char*>>{
           {"add", "+"}, {"sub", "-"}, {"mul", "*"}, {"truediv", "/"}}) {
    add((std::string("__") + method + "__").c_str(), std::string("a0 ") + mark + " a1");
    add((std::string("__r") + method + "__").c_str(), std::string("a1 ") + mark + " a0");
  }
  add("__matmul__", "a0 * a1");
  add("__pow__", "pow(a0, a1)");
  add("__rpow__", "pow(a1, a0)");
  type.attr("__neg__") =
      py::cpp_function([](const py::object& a) { return call("-", py::make_tuple(a), {}, "-a0", true); },
                       py::name("__neg__"), py::is_method(type));
  type.attr("__abs__") = py::cpp_function(
      [](const py::object& a) { return call("abs", py::make_tuple(a), {}, "abs(a0)", true); },
      py::name("__abs__"), py::is_method(type));
  // So that an array times a field is asked of the field.
  type.attr("__array_ufunc__") = py::none();
}

py::list words() {
  py::list all;
  for (const felt::Function& function : apps::feltFunctions().functions()) {
    if (function.name.starts_with("operator")) continue;
    py::list parameters;
    for (const felt::Parameter& parameter : function.parameters)
      parameters.append(
          py::make_tuple(parameter.name, typeName(parameter.type), parameter.standard.has_value()));
    all.append(py::dict("name"_a = function.name, "signature"_a = function.signature,
                        "text"_a = function.text, "group"_a = function.group,
                        "result"_a = typeName(function.result), "parameters"_a = parameters));
  }
  return all;
}

/// Runs a script and returns its variables by name.
py::dict runScript(const std::string& text, const std::map<std::string, std::string>& settings,
                   const std::string& name, const py::object& progress) {
  std::vector<felt::Named> variables;
  Watch watch;
  try {
    watched(watch, progress, [&] {
      const felt::Program program(name, text, apps::feltFunctions(), apps::namesOfPlace(0, 0).given);
      std::vector<std::string> known;
      for (const felt::ScriptParameter& parameter : program.parameters()) known.push_back(parameter.name);
      for (const auto& [key, value] : settings) {
        if (std::find(known.begin(), known.end(), key) != known.end()) continue;
        const std::string near = nearestName(key, known);
        throw Error(name + ": has no parameter '" + key + "'" +
                    (near.empty() ? "" : "; did you mean '" + near + "'?"));
      }
      felt::Context context{.progress = &watch};
      context.print = [](const std::string& line) {
        const py::gil_scoped_acquire acquire;
        py::print(line);
      };
      variables = program.run(context, {.settings = settings});
    });
  } catch (const felt::ScriptError& error) {
    throw Error(error.what());
  }
  py::dict result;
  for (const felt::Named& variable : variables) result[py::cast(variable.name)] = toPython(variable.value);
  return result;
}

template <class T>
py::object fieldOf(const std::shared_ptr<felt::Cache<T>>& cache) {
  if (!cache->values) return py::none();
  return py::cast(PythonField<T>{Value(*cache->values)});
}

}  // namespace

Vec3d vectorFrom(const py::handle& object, const std::string& what) {
  if (!PySequence_Check(object.ptr()) && !py::isinstance<py::array>(object))
    throw py::type_error(what + ": three numbers are needed, got a " +
                         std::string(py::str(py::type::of(object).attr("__name__"))));
  const auto array = Packed<double>::ensure(object);
  if (!array) {
    PyErr_Clear();
    throw py::type_error(what + ": three numbers are needed");
  }
  if (array.ndim() != 1 || array.shape(0) != 3)
    throw py::value_error(what + ": three numbers are needed, got " + shapeText(array));
  return {array.data()[0], array.data()[1], array.data()[2]};
}

py::object toPython(const Value& value) {
  return std::visit(
      [&]<class T>(const T& held) -> py::object {
        if constexpr (std::is_same_v<T, std::monostate>)
          return py::none();
        else if constexpr (std::is_same_v<T, ScalarField>)
          return py::cast(PythonScalarField{value});
        else if constexpr (std::is_same_v<T, VectorField>)
          return py::cast(PythonVectorField{value});
        else if constexpr (std::is_same_v<T, MatrixField>)
          return py::cast(PythonMatrixField{value});
        else if constexpr (std::is_same_v<T, Vec3d>)
          return py::array_t<double>(std::vector<py::ssize_t>{3}, &held.x);
        else if constexpr (std::is_same_v<T, Mat3f>)
          return py::array_t<float>(std::vector<py::ssize_t>{3, 3}, held.m.data());
        else if constexpr (std::is_same_v<T, std::shared_ptr<felt::Cache<float>>> ||
                           std::is_same_v<T, std::shared_ptr<felt::Cache<Vec3f>>> ||
                           std::is_same_v<T, std::shared_ptr<felt::Cache<Mat3f>>>)
          return fieldOf(held);
        else if constexpr (std::is_same_v<T, PythonMesh>)
          return py::cast(std::const_pointer_cast<felt::Shape>(held));
        else if constexpr (std::is_same_v<T, felt::Array>) {
          py::list list;
          for (const Value& item : *held) list.append(toPython(item));
          return list;
        } else {
          return py::cast(held);
        }
      },
      value.held());
}

void addWords(py::module_& module) {
  py::class_<felt::Domain>(module, "Domain",
                           "A box with cells, where fields are sampled; made by nephele.domain.")
      .def("__repr__", [](const felt::Domain& domain) {
        return "<nephele.Domain " + shown(Value(domain), {Kind::domain}) + ">";
      });
  addOperators<float>(module, "ScalarField");
  addOperators<Vec3f>(module, "VectorField");
  addOperators<Mat3f>(module, "MatrixField");
  const auto component = [](const py::object& self, int index) {
    // Loops over the three end by this.
    if (index < 0 || index > 2) throw py::index_error("fields of vectors have the components 0, 1 and 2");
    return call("component", py::make_tuple(self, index), {}, "component(a0, a1)", true);
  };
  auto vector = module.attr("VectorField");
  const char* axes[] = {"x", "y", "z"};
  const auto property = py::module_::import("builtins").attr("property");
  for (int axis = 0; axis < 3; ++axis)
    vector.attr(axes[axis]) = property(py::cpp_function(
        [=](const py::object& self) { return component(self, axis); }, py::is_method(vector)));
  vector.attr("__getitem__") = py::cpp_function(component, py::name("__getitem__"), py::is_method(vector));
  module.def("_words", words, "What scripts may call.");
  module.def(
      "_call",
      [](const std::string& word, const py::tuple& arguments, const py::dict& named) {
        return call(word, py::reinterpret_borrow<py::args>(arguments),
                    py::reinterpret_borrow<py::kwargs>(named), "", false);
      },
      "Calls a word.");
  module.def("_run_script", runScript, "text"_a, "settings"_a, "name"_a, "progress"_a);
}

}  // namespace nephele::python
