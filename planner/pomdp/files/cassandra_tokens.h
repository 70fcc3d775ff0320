#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace feeler::planner {

/// Words of Cassandra's format, with their lines. `:` and `*` are words of their own; `#` begins a comment.
class CassandraTokens {
 public:
  CassandraTokens(std::string_view text, std::string name);

  bool done() const { return at_ == tokens_.size(); }
  /// The word `ahead` of the next one; empty past the end.
  std::string_view Peek(std::size_t ahead = 0) const {
    return at_ + ahead < tokens_.size() ? tokens_[at_ + ahead].text : std::string_view();
  }
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
  int line() const { return at_ == 0 ? 1 : tokens_[at_ - 1].line; }
  [[noreturn]] void Fail(const std::string& what, const std::string& mend) const { FailAt(line(), what, mend); }
  [[noreturn]] void FailAt(int line, const std::string& what, const std::string& mend) const;

 private:
  struct Token {
    std::string_view text;
    int line = 1;
  };
  std::string name_;
  std::vector<Token> tokens_;
  std::size_t at_ = 0;
};

}  // namespace feeler::planner
