#pragma once

#include <span>
#include <tuple>
#include <type_traits>
#include <vector>

#include "nephele/modeling/felt/context.h"
#include "nephele/modeling/felt/value.h"

/// How functions of C++ are called with values of scripts.
namespace nephele::felt {

/// What a built-in function is called with.
struct Call {
  std::span<const Value> arguments;
  /// Of the arguments as they stand in the script; of interest where a parameter may be anything.
  std::span<const Type> types;
  Context& context;
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

}  // namespace nephele::felt
