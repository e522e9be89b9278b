#pragma once

#include <pybind11/pybind11.h>

#include <string>

namespace pybind11::detail {

/// Texts as Python has them where names of files may be any bytes: what is no UTF-8 stands as os.fsdecode has
/// it. Bytes are taken as they are.
template <>
struct type_caster<std::string> {
  PYBIND11_TYPE_CASTER(std::string, const_name("str"));

  bool load(handle source, bool) {
    object bytes = reinterpret_borrow<object>(source);
    if (PyUnicode_Check(source.ptr()) != 0)
      for (const char* others : {"surrogateescape", "surrogatepass"}) {
        PyErr_Clear();
        bytes = reinterpret_steal<object>(PyUnicode_AsEncodedString(source.ptr(), "utf-8", others));
        if (bytes) break;
      }
    if (!bytes || PyBytes_Check(bytes.ptr()) == 0) {
      PyErr_Clear();
      return false;
    }
    value.assign(PyBytes_AS_STRING(bytes.ptr()), std::size_t(PyBytes_GET_SIZE(bytes.ptr())));
    return true;
  }

  static handle cast(const std::string& text, return_value_policy, handle) {
    return PyUnicode_DecodeUTF8(text.data(), ssize_t(text.size()), "surrogateescape");
  }
};

}  // namespace pybind11::detail
