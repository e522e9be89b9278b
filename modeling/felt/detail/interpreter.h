#pragma once

#include <map>
#include <vector>

#include "nephele/modeling/felt/context.h"
#include "nephele/modeling/felt/detail/checker.h"

namespace nephele::felt {

/// A fault of a run on its way out of the script.
struct RunFault {
  Diagnostic diagnostic;
};

/// Carries out what a Checker has found good.
class Interpreter {
 public:
  /// Both must outlive this.
  Interpreter(const Checker& checker, Context& context) : checker_(checker), context_(context) {}

  /// Values of variables outside of functions, by slot.
  std::vector<Value>& globals() { return globals_; }
  /// What a parameter is instead of its value in the script; evaluated where it is declared.
  void set(int slot, const Expression& value) { settings_[slot] = &value; }

  /// Before what has been checked since: there is room for what it declares, and limits count from here on.
  void begin();
  /// @throws RunFault; Cancelled.
  void run(const std::vector<StatementPtr>& statements);
  /// @throws RunFault; Cancelled.
  Value evaluate(const Expression& expression);

  /// From now on notes which fields are made of which.
  void keepParts() { keepsParts_ = true; }
  /// Different operations that a field is made of, itself counted. Needs keepParts.
  std::size_t operationsOf(const Value& field) const;

 private:
  enum class Flow { on, leaveLoop, nextTurn, giveBack };
  struct Made {
    Value value;
    std::vector<const void*> parts;
  };

  [[noreturn]] static void fail(Code code, const Span& span, std::string message, std::string hint = {});
  Flow carryOut(const Statement& statement);
  Flow block(const Statement& statement);
  Flow loop(const Statement& statement);
  void declaration(const Statement& statement);
  void assignment(const Statement& statement);
  void parameter(const ParameterDeclaration& parameter);
  bool isTrue(const Expression& condition) { return evaluate(condition).as<bool>(); }

  Value call(const Expression& call);
  Value callBuiltIn(const Expression& call);
  Value callOwn(const Expression& call);
  Value element(const Expression& expression);
  Value& variable(bool isGlobal, int slot) { return isGlobal ? globals_[slot] : locals_[frame_ + slot]; }
  Value remembered(Value value, bool isGlobal, int slot);
  double longestSide(const Expression& expression) const;
  void countStatement(const Span& span);

  const Checker& checker_;
  Context& context_;
  std::vector<Value> globals_;
  std::map<int, const Expression*> settings_;
  std::int64_t targetIndex_ = 0;
  std::vector<Value> locals_;
  std::size_t frame_ = 0;
  const FunctionDeclaration* function_ = nullptr;
  int calls_ = 0;
  std::int64_t statements_ = 0;
  Value result_;
  bool keepsParts_ = false;
  std::map<const void*, Made> made_;
};

}  // namespace nephele::felt
