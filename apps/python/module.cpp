#include <pybind11/pybind11.h>

#include <exception>
#include <string>
#include <utility>

#include "apps/python/values.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace {

namespace py = pybind11;

/// The exceptions of the module, which live as long as the program.
PyObject *errorType, *cancelledType;

void raise(PyObject* type, const std::exception& error) {
  const std::string text = error.what();
  PyErr_SetObject(type, py::cast(text).ptr());
}

void translate(std::exception_ptr thrown) {
  try {
    if (thrown) std::rethrow_exception(std::move(thrown));
  } catch (const nephele::Cancelled& error) {
    raise(cancelledType, error);
  } catch (const nephele::Error& error) {
    raise(errorType, error);
  }
}

}  // namespace

PYBIND11_MODULE(_nephele, module) {
  using namespace nephele::python;
  module.doc() = "The part of nephele that is C++; import nephele.";
  errorType = py::exception<nephele::Error>(module, "Error").release().ptr();
  cancelledType = py::exception<nephele::Cancelled>(module, "Cancelled", errorType).release().ptr();
  // Messages name files, whose names may be no UTF-8, which py::register_exception does not take.
  py::register_exception_translator(translate);
  module.attr("__version__") = NEPHELE_VERSION;
  addPictures(module);
  addMeshes(module);
  addGrids(module);
  addFields(module);
  addWords(module);
  addVerbs(module);
  addPickles(module);
  module.def("thread_count", &nephele::threadCount, "Threads that work runs on at most.");
}
