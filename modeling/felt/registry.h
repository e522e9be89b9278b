#pragma once

#include <deque>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "nephele/modeling/felt/binding.h"

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
  /// The result holds samples of its arguments, not the arguments.
  bool isSampled = false;
  /// It reads or writes files or makes grids, so that an error of it need not be the script's fault.
  bool isOfData = false;
  std::function<Value(Call&)> run;
};

class Registry {
 public:
  Registry() = default;
  Registry(const Registry&) = delete;
  Registry& operator=(const Registry&) = delete;

  /// The heading of what is added from now on.
  void group(std::string name) { group_ = std::move(name); }
  /// What is added from now on reads or writes files or makes grids.
  void beginData() { isOfData_ = true; }

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
  bool isOfData_ = false;
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
  using Indices = std::make_index_sequence<std::tuple_size_v<All> - kFirst>;
  Function& added =
      addGeneral(std::move(signature), std::move(text), std::move(example), [function](Call& call) -> Value {
        if constexpr (std::is_void_v<typename Described::Returned>) {
          detail::invoked<kWantsContext, All>(function, call, Indices());
          return {};
        } else {
          return Value(detail::invoked<kWantsContext, All>(function, call, Indices()));
        }
      });
  requireKinds(added, detail::typesOf<kFirst, All>(Indices()));
  return added;
}

}  // namespace nephele::felt
