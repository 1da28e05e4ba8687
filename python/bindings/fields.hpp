// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cstdlib>
#include <functional>
#include <limits>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "bindings.hpp"
#include "fields/field.hpp"

/// Plain structs of the library as Python classes, made from their fields::Fields: constructor,
/// attributes, repr, equality, pickle.
namespace gpureg::python {

/// The shortest decimal that is this float: 0.05, not 0.05000000074505806. It converts back
/// exactly.
inline double shortest(float value) {
  char text[64] = {};
  std::to_chars(text, text + sizeof(text) - 1, value);
  return std::strtod(text, nullptr);
}

template <typename T>
struct Field {
  std::string name, doc;
  std::function<py::object(const T&)> get;
  std::function<void(T&, py::handle)> set;
  std::function<void(py::class_<T>&, const Field<T>&, bool writable)> define;
};

/// Python's bool, or numpy's.
inline bool is_bool(py::handle value) {
  return PyBool_Check(value.ptr()) ||
         std::string_view(Py_TYPE(value.ptr())->tp_name).substr(0, 10) == "numpy.bool";
}

/// Enumerations are strings in Python.
template <typename M, typename = void>
constexpr bool is_named = false;
template <typename M>
constexpr bool is_named<M, std::void_t<decltype(fields::Values<M>::kAll)>> = true;

template <typename M>
M convert(py::handle value) {
  if constexpr (is_named<M>) {
    if (const M* named = fields::value_named<M>(value.cast<std::string>())) return *named;
    throw py::cast_error();
  } else {
    // A bool is an int in Python; as a length or a count it is a mistake.
    if (!std::is_same_v<M, bool> && std::is_arithmetic_v<M> && is_bool(value))
      throw py::cast_error();
    return value.cast<M>();
  }
}

template <typename M>
std::string expected() {
  if constexpr (std::is_same_v<M, bool>)
    return "True or False";
  else if constexpr (is_named<M>)
    return fields::names_of<M>("'");
  else if constexpr (std::is_floating_point_v<M>)
    return "a number";
  else if constexpr (std::is_same_v<M, std::string>)
    return "a text";
  else if constexpr (std::is_same_v<M, std::array<double, 6>>)
    return "6 numbers";
  else if constexpr (std::is_integral_v<M>)
    return "a whole number from 0 to " + std::to_string(std::numeric_limits<M>::max());
  else
    return py::type::of<M>().attr("__name__").template cast<std::string>();
}

/// A value in an error message: one line, not too long.
inline std::string shown(py::handle value) {
  std::string text =
      py::reinterpret_steal<py::object>(PyObject_ASCII(value.ptr())).cast<std::string>();
  std::replace(text.begin(), text.end(), '\n', ' ');
  constexpr std::size_t most = 80;
  return text.size() <= most ? text : text.substr(0, most - 3) + "...";
}

/// An argument of a function. Raises TypeError, or ValueError for a whole number out of range, that
/// names it: what pybind11 raises by itself is a list of signatures.
template <typename M>
M argument(py::handle value, const std::string& name, const std::string& what = expected<M>()) {
  try {
    return convert<M>(value);
  } catch (const py::cast_error&) {
    const std::string message = name + ": expected " + what + ", got " + shown(value);
    if (PyLong_Check(value.ptr()) && !is_bool(value)) throw py::value_error(message);
    throw py::type_error(message);
  }
}

/// Constructors that take keywords only say so.
inline void require_no_positional(const py::args& values, const std::string& cls,
                                  const std::string& keyword) {
  if (!values.empty())
    throw py::type_error(cls + ": expected keywords, such as " + cls + "(" + keyword +
                         "=...), got " + shown(values[0]));
}

/// Once per class, not per type of a field: pybind11 makes much code of every function.
template <typename T>
void define_value(py::class_<T>& cls, const Field<T>& f, bool writable) {
  const auto get = [get = f.get](const T& t) { return get(t); };
  if (writable)
    cls.def_property(
        f.name.c_str(), get, [set = f.set](T& t, const py::object& value) { set(t, value); },
        f.doc.c_str());
  else
    cls.def_property_readonly(f.name.c_str(), get, f.doc.c_str());
}

template <typename T, typename M>
Field<T> field(std::string name, M T::* member, std::string doc) {
  Field<T> f;
  f.name = name;
  f.doc = doc;
  f.get = [member](const T& t) -> py::object {
    if constexpr (std::is_same_v<M, float>)
      return py::float_(shortest(t.*member));
    else if constexpr (is_named<M>)
      return py::str(to_string(t.*member));
    else
      return py::cast(t.*member);
  };
  f.set = [name, member](T& t, py::handle value) {
    try {
      t.*member = convert<M>(value);
    } catch (const py::cast_error&) {
      throw py::type_error(name + ": expected " + expected<M>() + ", got " + shown(value));
    }
  };
  f.define = [member](py::class_<T>& cls, const Field<T>& self, bool writable) {
    if constexpr (std::is_class_v<M> && !std::is_same_v<M, std::string>) {
      // By reference, so that options.prepare.depth_maps = 4 changes options.
      if (writable)
        cls.def_property(
            self.name.c_str(), [member](T& t) -> M& { return t.*member; },
            [set = self.set](T& t, const py::object& value) { set(t, value); }, self.doc.c_str());
      else
        cls.def_readonly(self.name.c_str(), member, self.doc.c_str());
    } else {
      define_value(cls, self, writable);
    }
  };
  return f;
}

/// Sentence, then unit or range, or the names of an enumeration.
template <typename M>
std::string docstring(const fields::Field& field) {
  std::string more;
  if constexpr (is_named<M>)
    more = fields::names_of<M>("'");
  else
    more = fields::described(field.range);
  if (more.empty()) return field.sentence;
  more[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(more[0])));
  return field.sentence + (" " + more) + ".";
}

/// The described fields of T.
template <typename T>
const std::vector<Field<T>>& fields_of() {
  static const std::vector<Field<T>> all = [] {
    std::vector<Field<T>> out;
    fields::each<T>([&](const std::string& name, auto member, const fields::Field& description) {
      using M = std::remove_reference_t<decltype(std::declval<T&>().*member)>;
      out.push_back(field(name, member, docstring<M>(description)));
    });
    return out;
  }();
  return all;
}

template <typename T>
py::dict to_dict(const T& t, const std::vector<Field<T>>& fields) {
  py::dict out;
  for (const Field<T>& f : fields) out[f.name.c_str()] = f.get(t);
  return out;
}

/// Throws TypeError for a name that is no field, and lists those that are.
template <typename T>
void assign(T& t, const std::vector<Field<T>>& fields, const py::dict& values,
            const std::string& cls) {
  for (const auto& [key, value] : values) {
    const std::string name = py::str(key);
    bool known = false;
    for (const Field<T>& f : fields)
      if (f.name == name) {
        f.set(t, value);
        known = true;
      }
    if (known) continue;
    std::string names;
    for (const Field<T>& f : fields) names += (names.empty() ? "" : ", ") + f.name;
    throw py::type_error(cls + " has no option '" + name + "'; it has " + names);
  }
}

template <typename T>
void define_common(py::class_<T>& cls, const std::string& name,
                   const std::vector<Field<T>>& fields) {
  py::list names;
  for (const Field<T>& f : fields) names.append(f.name);
  cls.attr("_fields") = py::tuple(names);
  cls.def("__eq__", [fields](const T& a, const py::object& other) -> py::object {
    if (!py::isinstance<T>(other)) return py::reinterpret_borrow<py::object>(Py_NotImplemented);
    return py::bool_(to_dict(a, fields).equal(to_dict(other.cast<const T&>(), fields)));
  });
  cls.attr("__hash__") = py::none();
  cls.def(py::pickle([fields](const T& t) { return to_dict(t, fields); },
                     [fields, name](const py::dict& state) {
                       T t;
                       assign(t, fields, state, name);
                       return t;
                     }));
}

template <typename T>
std::string keyword_repr(const T& t, const std::string& name, const std::vector<Field<T>>& fields) {
  std::string text;
  for (const Field<T>& f : fields)
    text +=
        (text.empty() ? "" : ", ") + f.name + "=" + py::repr(f.get(t)).template cast<std::string>();
  return name + "(" + text + ")";
}

/// A struct that callers fill in: constructed by keywords, defaults from the C++ object.
template <typename T>
py::class_<T> bind_options_class(py::module_& m, const std::string& name, const char* doc,
                                 std::vector<Field<T>> fields) {
  for (Field<T>& f : fields) {
    const auto inner = f.set;
    f.set = [inner, name](T& t, py::handle value) {
      try {
        inner(t, value);
      } catch (const py::type_error& e) {
        throw py::type_error(name + "." + e.what());
      }
    };
  }
  py::class_<T> cls(m, name.c_str(), doc);
  cls.def(py::init([fields, name](const py::args& positional, const py::kwargs& values) {
    require_no_positional(positional, name, fields.front().name);
    T t;
    assign(t, fields, values, name);
    return t;
  }));
  for (const Field<T>& f : fields) f.define(cls, f, true);
  define_common(cls, name, fields);
  cls.def(
      "replace",
      [fields, name](const T& t, const py::kwargs& values) {
        T copy = t;
        assign(copy, fields, values, name);
        return copy;
      },
      "A copy with some fields changed.");
  cls.def("validate", &T::validate, "Raises InvalidArgument naming the first field out of range.");
  cls.def("__repr__", [fields, name](const T& t) { return keyword_repr(t, name, fields); });
  return cls;
}

/// A struct that the library fills in: attributes are read-only.
template <typename T>
py::class_<T> bind_record_class(py::module_& m, const std::string& name, const char* doc,
                                const std::vector<Field<T>>& fields) {
  py::class_<T> cls(m, name.c_str(), doc);
  for (const Field<T>& f : fields) f.define(cls, f, false);
  define_common(cls, name, fields);
  cls.def("__repr__", [fields, name](const T& t) { return keyword_repr(t, name, fields); });
  return cls;
}

/// The same for structs that are described.
template <typename T>
py::class_<T> bind_options_class(py::module_& m) {
  return bind_options_class<T>(m, fields::Fields<T>::kName, fields::Fields<T>::kSentence,
                               fields_of<T>());
}
template <typename T>
py::class_<T> bind_record_class(py::module_& m) {
  return bind_record_class<T>(m, fields::Fields<T>::kName, fields::Fields<T>::kSentence,
                              fields_of<T>());
}

}  // namespace gpureg::python
