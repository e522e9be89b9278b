#pragma once

#include <map>
#include <string>
#include <vector>

#include "nephele/modeling/felt/detail/syntax.h"
#include "nephele/modeling/felt/diagnostic.h"
#include "nephele/modeling/felt/registry.h"

namespace nephele::felt {

/// A variable outside of functions, or one of a function.
struct Variable {
  std::string name;
  Type type;
  /// How often it is read, which tells what is worth remembering; a read in a loop counts as two.
  int reads = 0;
  /// Whether it is seen outside of the block that it stands in.
  bool isOutermost = false;
};

/// Gives every expression its type, every name its meaning and every conversion its node. Keeps what was
/// declared, so that a program may be checked part by part.
class Checker {
 public:
  explicit Checker(const Registry& registry) : registry_(registry) { scopes_.emplace_back(); }

  /// Declares a variable outside of functions and returns its slot.
  int declare(const std::string& name, const Type& type);

  /// Checks statements, which must outlive this. All faults are added to `diagnostics`, warnings too; where
  /// there are errors the statements must not be run, and nothing that they declare stays.
  /// @param mayRedeclare a name may be declared again, as people do line by line.
  void check(std::vector<StatementPtr>& statements, std::vector<Diagnostic>& diagnostics,
             bool mayRedeclare = false);

  /// Checks an expression among what is declared; it is converted to `wanted` unless that is void.
  void checkExpression(ExpressionPtr& expression, const Type& wanted, std::vector<Diagnostic>& diagnostics);

  /// By slot.
  const std::vector<Variable>& globals() const { return globals_; }
  const std::vector<Variable>& locals(const FunctionDeclaration& function) const {
    return locals_.at(&function);
  }
  /// The slot of a variable outside of all blocks, or -1.
  int slotOf(const std::string& name) const;

 private:
  struct Seen {
    int slot;
    bool isGlobal;
  };
  struct Candidate;
  using Scope = std::map<std::string, Seen, std::less<>>;

  void fault(Code code, const Span& span, std::string message, std::string hint = {});
  std::vector<Variable>& variables(bool isGlobal) { return isGlobal ? globals_ : locals_[function_]; }
  const Seen* find(const std::string& name) const;
  int declare(const DeclaredName& name, bool mayRedeclare);
  std::vector<std::string> namesInSight() const;

  void collectFunctions(const std::vector<StatementPtr>& statements, bool mayRedeclare);
  void statement(Statement& statement);
  void block(Statement& block);
  void loop(Statement& statement);
  void declaration(Statement& statement);
  void assignment(Statement& statement);
  void condition(ExpressionPtr& expression);
  void giveBack(Statement& statement);
  void function(FunctionDeclaration& function);
  void parameter(ParameterDeclaration& parameter);
  static bool alwaysReturns(const Statement& statement);

  /// False where it has a fault, which has been told; its type is void then.
  bool expression(ExpressionPtr& expression, const Type& wanted = {});
  bool typed(ExpressionPtr& expression, const Type& wanted);
  bool variable(Expression& expression);
  bool call(ExpressionPtr& expression);
  bool index(ExpressionPtr& expression);
  bool member(ExpressionPtr& expression);
  bool triple(ExpressionPtr& expression);
  bool array(Expression& expression, const Type& wanted);
  bool conditional(Expression& expression);
  bool logical(Expression& expression);
  bool convert(ExpressionPtr& expression, const Type& to, const std::string& what);
  void noSuchCall(const Expression& call, const std::vector<Candidate>& candidates);
  void warnOfIntegers(const Expression& call);

  const Registry& registry_;
  std::vector<Diagnostic>* diagnostics_ = nullptr;
  std::vector<Scope> scopes_;
  std::vector<Variable> globals_;
  std::map<const FunctionDeclaration*, std::vector<Variable>> locals_;
  std::multimap<std::string, const FunctionDeclaration*, std::less<>> functions_;
  /// The function whose body is looked at, or null.
  FunctionDeclaration* function_ = nullptr;
  int loops_ = 0;
  bool mayRedeclare_ = false;
  /// Slots of what was there before any statement.
  int given_ = 0;
};

}  // namespace nephele::felt
