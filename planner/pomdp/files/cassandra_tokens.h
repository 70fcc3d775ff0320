#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <string_view>

#include "feeler/planner/pomdp/model/pulse.h"

namespace feeler::planner {

/// Words of Cassandra's format, with their lines. `:` and `*` are words of their own; `#` begins a comment.
class CassandraTokens {
 public:
  /// `pulse` may be null; it is told of each word.
  CassandraTokens(std::string_view text, std::string name, Pulse* pulse = nullptr);

  bool done() const { return !Ahead(0); }
  /// The word `ahead` of the next one; empty past the end.
  std::string_view Peek(std::size_t ahead = 0) const { return Ahead(ahead) ? ahead_[ahead].text : std::string_view(); }
  /// Throws InputError at the end of the file; `wanted` says what is missing.
  std::string_view Next(std::string_view wanted);
  /// True, and passes it, if the next word is this one.
  bool Accept(std::string_view word);
  void Expect(std::string_view word, std::string_view wanted);
  /// True if the words `ahead` of the next one are a keyword and its colon: a statement ends there.
  bool AtStatement(std::size_t ahead = 0) const;
  /// A number; infinities and what does not parse are errors.
  double Number(std::string_view wanted);
  static bool IsNumber(std::string_view word);
  static bool IsInteger(std::string_view word);

  /// Of the word read last.
  int line() const { return line_; }
  [[noreturn]] void Fail(const std::string& what, const std::string& mend) const { FailAt(line(), what, mend); }
  [[noreturn]] void FailAt(int line, const std::string& what, const std::string& mend) const;

 private:
  struct Token {
    std::string_view text;
    int line = 1;
  };
  /// Reads on until there are more than `count` words ahead; false past the end.
  bool Ahead(std::size_t count) const;

  std::string name_;
  Pulse* pulse_;
  std::string_view text_;
  int line_ = 1;
  // Files may have tens of millions of words: they are cut out as they are asked for.
  mutable std::deque<Token> ahead_;
  mutable std::size_t at_ = 0;
  mutable int at_line_ = 1;
};

}  // namespace feeler::planner
