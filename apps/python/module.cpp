#include <pybind11/pybind11.h>

#include "apps/python/values.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

PYBIND11_MODULE(_nephele, module) {
  using namespace nephele::python;
  module.doc() = "The part of nephele that is C++; import nephele.";
  py::register_exception<nephele::Error>(module, "Error");
  py::register_exception<nephele::Cancelled>(module, "Cancelled", module.attr("Error"));
  module.attr("__version__") = NEPHELE_VERSION;
  addPictures(module);
  addMeshes(module);
  addGrids(module);
  addFields(module);
  addWords(module);
  addVerbs(module);
  module.def("thread_count", &nephele::threadCount, "Threads that work runs on at most.");
}
