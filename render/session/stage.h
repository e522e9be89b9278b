#pragma once

#include <memory>
#include <string>
#include <utility>

namespace nephele {

/// The latest result of one step of work, kept until it is asked for under another key.
///
/// A key says all that the result depends on: equal keys stand for equal results. The key of a step contains
/// those of the steps before it. Not for several threads at once; the results are.
template <class T>
class Stage {
 public:
  using Result = std::shared_ptr<const T>;

  /// What is kept, or what `make` returns where that is of another key: a Result. What was kept is let go
  /// before, so that two large results never stand side by side; nothing is kept where `make` throws.
  template <class Make>
  const Result& at(const std::string& key, Make&& make) {
    if (isAt(key)) return result_;
    forget();
    result_ = std::forward<Make>(make)();
    key_ = key;
    return result_;
  }
  bool isAt(const std::string& key) const { return result_ && key == key_; }
  /// Null where nothing is kept.
  const Result& kept() const { return result_; }
  const std::string& key() const { return key_; }
  void forget() {
    result_.reset();
    key_.clear();
  }

 private:
  Result result_;
  std::string key_;
};

}  // namespace nephele
