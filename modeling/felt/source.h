#pragma once

#include <string>
#include <string_view>
#include <vector>

/// The texts that a script is made of, and places in them.
namespace nephele::felt {

/// Characters begin .. end - 1 of a file of `Sources`.
struct Span {
  int file = 0;
  int begin = 0;
  int end = 0;

  /// From the first character of `a` to the last one of `b`; they stand in one file.
  static Span joining(const Span& a, const Span& b) { return {a.file, a.begin, b.end}; }
};

/// Where a character stands, as editors count: from 1. Columns are characters of UTF-8.
struct Place {
  int line = 1;
  int column = 1;
};

/// A text and what it is called in messages: the path of a file, or the name of an option.
class Source {
 public:
  Source(std::string name, std::string text);

  const std::string& name() const { return name_; }
  const std::string& text() const { return text_; }
  Place placeOf(int offset) const;
  /// The offset of a place; the end of the text where there is no such place.
  int offsetOf(const Place& place) const;
  /// The line that holds the character at `offset`, without its end.
  std::string_view lineAt(int offset) const;
  /// The offset at which that line begins.
  int lineStart(int offset) const;

 private:
  std::string name_;
  std::string text_;
  std::vector<int> lineStarts_;
};

/// All texts of a program: the script first, then what it imports.
class Sources {
 public:
  /// Adds a text and returns its number. @throws Error if it is longer than 16 MiB.
  int add(std::string name, std::string text);
  const Source& operator[](int file) const { return files_[file]; }
  int count() const { return static_cast<int>(files_.size()); }
  std::string_view textOf(const Span& span) const;

 private:
  std::vector<Source> files_;
};

}  // namespace nephele::felt
