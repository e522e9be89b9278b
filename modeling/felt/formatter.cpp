#include <algorithm>
#include <array>

#include "nephele/modeling/felt/detail/parser.h"
#include "nephele/modeling/felt/detail/token.h"
#include "nephele/modeling/felt/program.h"

namespace nephele::felt {

namespace {

constexpr int kIndent = 2;
constexpr int kContinuation = 4;

bool isOneOf(const Token& token, std::initializer_list<std::string_view> marks) {
  return std::any_of(marks.begin(), marks.end(), [&](std::string_view mark) { return token.is(mark); });
}

/// Whether a value ends with this token, so that a sign after it joins two values.
bool endsValue(const Token& token) {
  if (token.kind == TokenKind::mark) return isOneOf(token, {")", "]"});
  return token.kind != TokenKind::end && !isOneOf(token, {"return", "in", "else"});
}

class Formatter {
 public:
  Formatter(const Sources& sources, const Tokens& tokens)
      : source_(sources[0]), sources_(sources), tokens_(tokens.tokens), comments_(tokens.comments) {}

  std::string run() {
    for (place_ = 0; tokens_[place_].kind != TokenKind::end; ++place_) {
      commentsBefore(tokens_[place_].span.begin);
      write(tokens_[place_]);
      lastEnd_ = tokens_[place_].span.end;
    }
    commentsBefore(static_cast<int>(source_.text().size()) + 1);
    endLine();
    return std::move(text_);
  }

 private:
  const Token* previous() const { return place_ > 0 ? &tokens_[place_ - 1] : nullptr; }
  const Token& next() const { return tokens_[place_ + 1]; }

  int lineBreaksBetween(int begin, int end) const {
    const std::string& text = source_.text();
    end = std::min(end, static_cast<int>(text.size()));
    return begin >= end ? 0 : static_cast<int>(std::count(text.begin() + begin, text.begin() + end, '\n'));
  }
  void endLine() {
    if (atLineStart_) return;
    text_ += '\n';
    atLineStart_ = true;
  }
  /// Begins a line where none is begun; an empty line of the script stays, but none after a brace.
  void beginLine(int begin, int extra) {
    if (!atLineStart_) return;
    const bool afterBrace = text_.ends_with("{\n") || text_.empty();
    if (lineBreaksBetween(lastEnd_, begin) > 1 && !afterBrace) text_ += '\n';
    text_ += std::string(static_cast<std::size_t>(std::max(0, depth_) * kIndent + extra), ' ');
    atLineStart_ = false;
  }

  void commentsBefore(int end) {
    while (comment_ < comments_.size() && comments_[comment_].span.begin < end) {
      const Comment& comment = comments_[comment_++];
      const std::string written(sources_.textOf(comment.span));
      // What ended its line in the script still does.
      const bool trails =
          comment.followsCode && lastEnd_ > 0 && lineBreaksBetween(lastEnd_, comment.span.begin) == 0;
      if (trails) {
        if (atLineStart_ && text_.ends_with('\n')) {
          text_.pop_back();
          atLineStart_ = false;
        }
        text_ += "  " + written;
      } else {
        const bool inside = !atLineStart_ || brackets_ > 0;
        endLine();
        beginLine(comment.span.begin, inside && !lineIsNew_ ? kContinuation : 0);
        text_ += written;
      }
      lastEnd_ = comment.span.end;
      const bool goesOn = written.starts_with("/*") && lineBreaksBetween(comment.span.end, nextBegin()) == 0;
      if (goesOn)
        text_ += ' ', afterComment_ = true;
      else
        endLine();
    }
  }
  int nextBegin() const { return tokens_[place_].span.begin; }

  void write(const Token& token) {
    if (token.is("}")) {
      --depth_;
      endLine();
      lineIsNew_ = true;
    }
    if (atLineStart_) {
      beginLine(token.span.begin, lineIsNew_ ? 0 : kContinuation);
    } else if (!lineIsNew_ && lineBreaksBetween(lastEnd_, token.span.begin) > 0 && !token.is("{")) {
      // A statement over several lines stays so.
      text_ += '\n';
      text_ += std::string(static_cast<std::size_t>(std::max(0, depth_) * kIndent + kContinuation), ' ');
    } else if (!afterComment_ && spaceBefore(token)) {
      text_ += ' ';
    }
    afterComment_ = false;
    lineIsNew_ = false;
    text_ += sources_.textOf(token.span);
    if (isOneOf(token, {"(", "["})) ++brackets_;
    if (isOneOf(token, {")", "]"})) brackets_ = std::max(0, brackets_ - 1);
    if (token.is("{")) {
      ++depth_;
      brackets_ = 0;
      finishLine();
    }
    if (token.is("}") && !next().is("else")) finishLine();
    if (token.is(";") && brackets_ == 0) finishLine();
  }
  void finishLine() {
    endLine();
    lineIsNew_ = true;
  }

  bool spaceBefore(const Token& token) const {
    const Token* before = previous();
    if (before == nullptr) return false;
    if (isOneOf(token, {",", ";", ")", "]", "."})) return false;
    if (isOneOf(*before, {"(", "[", "."})) return false;
    if (token.kind == TokenKind::mark && isOneOf(token, {"++", "--"})) return !endsValue(*before);
    if (before->kind == TokenKind::mark && isOneOf(*before, {"++", "--"}))
      return token.kind == TokenKind::mark;
    if (token.is("[")) return !endsValue(*before);
    if (token.is("("))
      return before->kind != TokenKind::name || isOneOf(*before, {"if", "for", "while", "return", "in"});
    if (before->is("!")) return false;
    // A sign that belongs to one value.
    if (before->kind == TokenKind::mark && isOneOf(*before, {"-", "+"}))
      return place_ >= 2 && endsValue(tokens_[place_ - 2]);
    return true;
  }

  const Source& source_;
  const Sources& sources_;
  const std::vector<Token>& tokens_;
  const std::vector<Comment>& comments_;
  std::string text_;
  std::size_t place_ = 0;
  std::size_t comment_ = 0;
  int lastEnd_ = 0;
  int depth_ = 0;
  int brackets_ = 0;
  bool atLineStart_ = true;
  bool lineIsNew_ = true;
  bool afterComment_ = false;
};

}  // namespace

std::string formattedScript(const std::string& name, const std::string& text) {
  Sources sources;
  std::vector<Diagnostic> diagnostics;
  const int file = sources.add(name, text);
  // Lines and levels follow from brackets, which only a script that can be read has in order.
  parse(sources, file, diagnostics);
  if (!diagnostics.empty()) throw ScriptError(std::move(diagnostics), sources);
  const Tokens tokens = tokensOf(sources, file, diagnostics);
  return Formatter(sources, tokens).run();
}

}  // namespace nephele::felt
