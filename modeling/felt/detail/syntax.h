#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nephele/modeling/felt/source.h"
#include "nephele/modeling/felt/value.h"

/// Scripts as trees. The parser makes them, the checker adds types and what names mean.
namespace nephele::felt {

struct Function;
struct FunctionDeclaration;
struct Expression;
using ExpressionPtr = std::unique_ptr<Expression>;

enum class ExpressionKind {
  literal,
  /// `2.5%`: a share of the longest side of the main shape.
  percent,
  /// `6x`: so many per longest side.
  perSide,
  variable,
  /// Of a function, a type or an operator; operators are called "operator+".
  call,
  /// `&&` and `||`, which need not look at their right side.
  logical,
  conditional,
  index,
  member,
  /// `(x, y, z)`.
  triple,
  array,
  /// Of the only part to the type of the expression; made by the checker.
  conversion,
  /// The index of the element that is assigned to, which is evaluated once.
  targetIndex,
};

struct Expression {
  ExpressionKind kind = ExpressionKind::literal;
  Span span;
  /// Of the variable, function, operator or member.
  std::string name{};
  Span nameSpan{};
  Value literal{};
  std::vector<ExpressionPtr> parts{};
  /// Of calls: for each part its name, empty where it has none.
  std::vector<std::string> partNames{};
  std::vector<Span> partNameSpans{};
  /// Levels of expressions below, itself counted.
  int height = 1;

  // From here on: what the checker found.
  Type type{};
  int slot = -1;
  bool isGlobal = false;
  const Function* function = nullptr;
  const FunctionDeclaration* declaration = nullptr;
};

struct Statement;
using StatementPtr = std::unique_ptr<Statement>;

enum class StatementKind {
  block,
  declaration,
  /// `target op= value`; `value` is whole already: `a += b` has become `a = a + b`.
  assignment,
  expression,
  branch,
  forLoop,
  whileLoop,
  giveBack,
  leaveLoop,
  nextTurn,
  function,
  parameter,
  import,
};

/// A name that a declaration or a header introduces.
struct DeclaredName {
  Type type;
  std::string name;
  Span nameSpan;
  /// The first value, or null.
  ExpressionPtr value{};
  int slot = -1;
};

struct FunctionDeclaration {
  Type result;
  std::string name;
  Span span;
  Span nameSpan;
  std::vector<DeclaredName> parameters;
  StatementPtr body;
  int frameSize = 0;

  /// As "scalarfield cumulo(scalarfield base, int iterations)".
  std::string signature() const;
};

/// `param float gain = 1 in [0, 4] "what it does";`
struct ParameterDeclaration {
  DeclaredName declared;
  /// Lowest and highest, or all choices; empty where everything goes.
  std::vector<ExpressionPtr> allowed;
  bool isColor = false;
  std::string text;
};

struct Statement {
  StatementKind kind = StatementKind::block;
  Span span;
  /// block: its statements; branch: what to do, what else; loops: the body; for: before, body, after each
  /// turn.
  std::vector<StatementPtr> parts{};
  /// Of assignment: target and value; of expression, return: the value; of loops and branches: the condition,
  /// or null.
  std::vector<ExpressionPtr> expressions{};
  std::vector<DeclaredName> names{};
  std::unique_ptr<FunctionDeclaration> function{};
  std::unique_ptr<ParameterDeclaration> parameter{};
  /// Stands for a declaration that could not be read.
  bool isBroken = false;
  /// Of import: the path as written.
  std::string path{};
};

}  // namespace nephele::felt
