#pragma once

#include <deque>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <vector>

#include "nephele/modeling/felt/context.h"
#include "nephele/modeling/felt/value.h"

/// The functions that scripts may call. Help and documentation are made from what is said of them here.
namespace nephele::felt {

struct Parameter {
  Type type;
  std::string name;
  /// What stands for an argument that is not given.
  std::optional<Value> standard{};
  Type standardType{};
  /// The standard value is a share of the longest side, or a number per longest side.
  enum class Unit { none, percent, perSide } unit = Unit::none;
};

/// What a built-in function is called with.
struct Call {
  std::span<const Value> arguments;
  /// Of the arguments as they stand in the script; of interest where a parameter may be anything.
  std::span<const Type> types;
  Context& context;
};

/// A built-in function or operator, of which there may be several with one name.
struct Function {
  std::string name;
  /// As "scalarfield sphere(vector center = (0, 0, 0), float radius = 1)".
  std::string signature;
  /// What it does: whole sentences.
  std::string text;
  /// Statements that show it.
  std::string example;
  /// The heading that it stands under.
  std::string group;
  Type result;
  std::vector<Parameter> parameters;
  /// Further arguments of any type may follow.
  bool isOpen = false;
  std::function<Value(Call&)> run;
};

namespace detail {

template <class T>
struct Signature;
template <class Result, class Object, class... Arguments>
struct Signature<Result (Object::*)(Arguments...) const> {
  using Tuple = std::tuple<std::decay_t<Arguments>...>;
  using Returned = Result;
};

/// The kind that a parameter of this C++ type has in signatures.
template <class T>
constexpr Kind kKindOf = Kind::anything;
template <>
inline constexpr Kind kKindOf<std::int64_t> = Kind::integer;
template <>
inline constexpr Kind kKindOf<double> = Kind::number;
template <>
inline constexpr Kind kKindOf<bool> = Kind::boolean;
template <>
inline constexpr Kind kKindOf<std::string> = Kind::text;
template <>
inline constexpr Kind kKindOf<Vec3d> = Kind::vector;
template <>
inline constexpr Kind kKindOf<Mat3f> = Kind::matrix;
template <>
inline constexpr Kind kKindOf<ScalarField> = Kind::scalarField;
template <>
inline constexpr Kind kKindOf<VectorField> = Kind::vectorField;
template <>
inline constexpr Kind kKindOf<MatrixField> = Kind::matrixField;
template <>
inline constexpr Kind kKindOf<Domain> = Kind::domain;
template <>
inline constexpr Kind kKindOf<std::shared_ptr<Cache<float>>> = Kind::scalarCache;
template <>
inline constexpr Kind kKindOf<std::shared_ptr<Cache<Vec3f>>> = Kind::vectorCache;
template <>
inline constexpr Kind kKindOf<std::shared_ptr<Cache<Mat3f>>> = Kind::matrixCache;
template <>
inline constexpr Kind kKindOf<std::shared_ptr<const Shape>> = Kind::shape;

/// `function(arguments...)` as a value; `all` are its parameters.
template <bool kWantsContext, class All, class F, std::size_t... I>
decltype(auto) invoked(const F& function, Call& call, std::index_sequence<I...>) {
  if constexpr (kWantsContext)
    return function(call.context, call.arguments[I].template as<std::tuple_element_t<I + 1, All>>()...);
  else
    return function(call.arguments[I].template as<std::tuple_element_t<I, All>>()...);
}

template <std::size_t kFirst, class All, std::size_t... I>
std::vector<Type> typesOf(std::index_sequence<I...>) {
  return {Type{kKindOf<std::tuple_element_t<I + kFirst, All>>,
               std::is_same_v<std::tuple_element_t<I + kFirst, All>, Array>}...};
}

}  // namespace detail

class Registry {
 public:
  Registry() = default;
  Registry(const Registry&) = delete;
  Registry& operator=(const Registry&) = delete;

  /// The heading of what is added from now on.
  void group(std::string name) { group_ = std::move(name); }

  /// Adds a function that is called with all arguments as values.
  /// @throws Error if the signature cannot be parsed: a fault of the program.
  Function& addGeneral(std::string signature, std::string text, std::string example,
                       std::function<Value(Call&)> run);

  /// Adds a function that C++ has: `function` takes, after a `Context&` if it wants one, a parameter for each
  /// of the signature (std::int64_t, double, bool, std::string, Vec3d, Mat3f, fields, Domain, shared pointers
  /// to caches and shapes, Array) and returns a value of that kind, or void.
  /// @throws Error if the two do not agree: a fault of the program.
  template <class F>
  Function& add(std::string signature, std::string text, std::string example, const F& function);

  /// All functions called `name`.
  std::vector<const Function*> named(std::string_view name) const;
  const std::deque<Function>& functions() const { return functions_; }
  /// Names of functions, without those of operators; each once, in alphabetical order.
  std::vector<std::string> names() const;

 private:
  static void requireKinds(const Function& function, std::span<const Type> types);

  std::string group_;
  std::deque<Function> functions_;
  std::multimap<std::string, std::size_t, std::less<>> byName_;
};

/// Adds what needs no grids: operators, fields, noises, shapes, cumulo, nacelle, advection.
void addModelingFunctions(Registry& registry);

template <class F>
Function& Registry::add(std::string signature, std::string text, std::string example, const F& function) {
  using Described = detail::Signature<decltype(&F::operator())>;
  using All = typename Described::Tuple;
  constexpr bool kWantsContext = [] {
    if constexpr (std::tuple_size_v<All> == 0)
      return false;
    else
      return std::is_same_v<std::tuple_element_t<0, All>, Context>;
  }();
  constexpr std::size_t kFirst = kWantsContext ? 1 : 0;
  constexpr auto kArguments = std::make_index_sequence<std::tuple_size_v<All> - kFirst>();
  Function& added =
      addGeneral(std::move(signature), std::move(text), std::move(example), [function](Call& call) -> Value {
        if constexpr (std::is_void_v<typename Described::Returned>) {
          detail::invoked<kWantsContext, All>(function, call, kArguments);
          return {};
        } else {
          return Value(detail::invoked<kWantsContext, All>(function, call, kArguments));
        }
      });
  requireKinds(added, detail::typesOf<kFirst, All>(kArguments));
  return added;
}

}  // namespace nephele::felt
