#include "feeler/planner/pomdp/files/cassandra_tokens.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "feeler/core/error.h"

namespace feeler::planner {
namespace {

bool IsSpace(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\f' || c == '\v'; }

/// For messages: words of binary files are cut short and made printable.
std::string Shown(std::string_view word) {
  std::string shown;
  for (const char c : word.substr(0, 40)) shown += c >= ' ' && c < 127 ? c : '?';
  return shown;
}

}  // namespace

CassandraTokens::CassandraTokens(std::string_view text, std::string name, Pulse* pulse)
    : name_(std::move(name)), pulse_(pulse), text_(text) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (text_.starts_with(kByteOrderMark)) text_.remove_prefix(kByteOrderMark.size());
}

bool CassandraTokens::Ahead(std::size_t count) const {
  while (ahead_.size() <= count && at_ < text_.size()) {
    const char c = text_[at_];
    if (c == '\n') ++at_line_;
    if (IsSpace(c)) {
      ++at_;
    } else if (c == '#') {
      while (at_ < text_.size() && text_[at_] != '\n') ++at_;
    } else if (c == ':' || c == '*') {
      ahead_.push_back({text_.substr(at_++, 1), at_line_});
    } else {
      const std::size_t begin = at_;
      while (at_ < text_.size() && !IsSpace(text_[at_]) && text_[at_] != ':' && text_[at_] != '#' && text_[at_] != '*')
        ++at_;
      ahead_.push_back({text_.substr(begin, at_ - begin), at_line_});
    }
  }
  return ahead_.size() > count;
}

std::string_view CassandraTokens::Next(std::string_view wanted) {
  if (done()) Fail(fmt::format("the file ends where {} should be", wanted), "is the file complete?");
  constexpr std::size_t kWordWork = 20;
  if (pulse_ != nullptr) (*pulse_)(kWordWork);
  const Token token = ahead_.front();
  ahead_.pop_front();
  line_ = token.line;
  return token.text;
}

bool CassandraTokens::Accept(std::string_view word) {
  if (done() || Peek() != word) return false;
  Next(word);
  return true;
}

void CassandraTokens::Expect(std::string_view word, std::string_view wanted) {
  const std::string_view found = Next(wanted);
  if (found != word) Fail(fmt::format("\"{}\" where {} should be", Shown(found), wanted), "see docs/pomdp.md");
}

bool CassandraTokens::AtStatement(std::size_t ahead) const {
  static constexpr std::string_view kKeywords[] = {"discount", "values", "states", "actions", "observations",
                                                   "start",    "T",      "O",      "R",       "E"};
  if (!Ahead(ahead)) return true;
  const std::string_view word = Peek(ahead);
  const std::string_view after = Peek(ahead + 1);
  if (std::ranges::find(kKeywords, word) == std::end(kKeywords)) return false;
  return after == ":" || (word == "start" && (after == "include" || after == "exclude"));
}

bool CassandraTokens::IsInteger(std::string_view word) {
  return !word.empty() && std::ranges::all_of(word, [](char c) { return c >= '0' && c <= '9'; });
}

bool CassandraTokens::IsNumber(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  // What is too small for a double reads as 0, what is too large is no number.
  const bool tiny =
      error == std::errc::result_out_of_range && std::abs(std::strtod(std::string(word).c_str(), nullptr)) < 1.0;
  return (error == std::errc() || tiny) && end == word.data() + word.size() && std::isfinite(value) &&
         (word[0] == '-' || word[0] == '.' || (word[0] >= '0' && word[0] <= '9'));
}

double CassandraTokens::Number(std::string_view wanted) {
  std::string_view word = Next(wanted);
  if (!IsNumber(word)) Fail(fmt::format("\"{}\" where {} should be", Shown(word), wanted), "give a number");
  if (word.starts_with('+')) word.remove_prefix(1);
  double value = 0.0;
  std::from_chars(word.data(), word.data() + word.size(), value);
  return value;
}

void CassandraTokens::FailAt(int line, const std::string& what, const std::string& mend) const {
  throw InputError(fmt::format("{}:{}", name_, line), what, mend);
}

}  // namespace feeler::planner
