// Laws of messages: one line of printable UTF-8 whatever the parts hold, long parts lose their middle and keep their
// ends, and every InputError in the sources says how to mend.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "feeler/core/error.h"
#include "feeler/core/json_depth.h"
#include "feeler/core/printable.h"

namespace feeler {
namespace {

namespace fs = std::filesystem;

/// RFC 3629 by its table, and no control character.
bool IsPrintableUtf8(const std::string& text) {
  for (std::size_t i = 0; i < text.size();) {
    const auto at = [&](std::size_t k) { return k < text.size() ? static_cast<unsigned char>(text[k]) : 0U; };
    const unsigned a = at(i), b = at(i + 1), c = at(i + 2), d = at(i + 3);
    const auto tail = [](unsigned byte) { return byte >= 0x80 && byte <= 0xbf; };
    if (a >= 0x20 && a <= 0x7e) {
      i += 1;
    } else if (a >= 0xc2 && a <= 0xdf && tail(b) && !(a == 0xc2 && b < 0xa0)) {
      i += 2;
    } else if (tail(c) && ((a == 0xe0 && b >= 0xa0 && b <= 0xbf) || (a >= 0xe1 && a <= 0xec && tail(b)) ||
                           (a == 0xed && b >= 0x80 && b <= 0x9f) || (a >= 0xee && a <= 0xef && tail(b)))) {
      i += 3;
    } else if (tail(c) && tail(d) &&
               ((a == 0xf0 && b >= 0x90 && b <= 0xbf) || (a >= 0xf1 && a <= 0xf3 && tail(b)) ||
                (a == 0xf4 && b >= 0x80 && b <= 0x8f))) {
      i += 4;
    } else {
      return false;
    }
  }
  return true;
}

TEST(Messages, AreOneLineOfPrintableTextWhateverTheyHold) {
  std::mt19937 random(7);
  for (int trial = 0; trial < 20000; ++trial) {
    std::string bytes(random() % 700, '\0');
    for (char& c : bytes) c = static_cast<char>(random() % (trial % 2 == 0 ? 256 : 48) + (trial % 3 == 0 ? 180 : 0));
    const std::string message = InputError(bytes, "x " + bytes, "mend").what();
    ASSERT_TRUE(IsPrintableUtf8(message)) << trial;
    ASSERT_TRUE(message.ends_with("(mend)"));
  }
  EXPECT_EQ(Printable(std::string("a\0b\x1b[31m\n\xff", 10)), "a\\x00b\\x1b[31m \\xff");
  EXPECT_EQ(Printable("größe 5 µm"), "größe 5 µm");
}

TEST(Messages, LongPartsLoseTheirMiddle) {
  const std::string message = InputError("begin" + std::string(5000, 'x') + "end", "what", "mend").what();
  EXPECT_LT(message.size(), 400U);
  EXPECT_TRUE(message.starts_with("begin"));
  EXPECT_NE(message.find("end: what (mend)"), std::string::npos);
  std::string umlauts;
  for (int i = 0; i < 3000; ++i) umlauts += "ü";
  EXPECT_TRUE(IsPrintableUtf8(Printable(umlauts, 101)));
}

TEST(JsonDepth, CountsBracketsOutsideOfTexts) {
  const auto nested = [](int levels) {
    return std::string(static_cast<std::size_t>(levels), '[') + std::string(static_cast<std::size_t>(levels), ']');
  };
  EXPECT_FALSE(IsNestedDeeper(nested(64)));
  EXPECT_TRUE(IsNestedDeeper(nested(65)));
  EXPECT_TRUE(IsNestedDeeper(std::string(100000, '[')));
  EXPECT_FALSE(IsNestedDeeper("\"" + std::string(100, '[') + "\\\"" + std::string(100, '{') + "\""));
}

/// The arguments of the call whose parenthesis opens before `begin`.
std::vector<std::string> Arguments(const std::string& text, std::size_t begin) {
  std::vector<std::string> arguments(1);
  int depth = 1;
  char quote = 0;
  for (std::size_t i = begin; i < text.size(); ++i) {
    const char c = text[i];
    if (quote != 0) {
      arguments.back() += c;
      if (c == '\\') arguments.back() += text[++i];
      if (c == quote) quote = 0;
      continue;
    }
    if (c == '"' || c == '\'') quote = c;
    if (c == '(' || c == '{' || c == '[') ++depth;
    if ((c == ')' || c == '}' || c == ']') && --depth == 0) break;
    if (c == ',' && depth == 1) {
      arguments.emplace_back();
    } else if (c != ' ' && c != '\n') {
      arguments.back() += c;
    }
  }
  return arguments;
}

TEST(Messages, EveryInputErrorSaysHowToMend) {
  int found = 0;
  for (const std::string room :
       {"core", "planner", "policies", "execution", "env", "cad", "perception", "workflow", "evaluation", "cli"}) {
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(FEELER_SOURCE_DIR) / room)) {
      const std::string extension = entry.path().extension();
      if (extension != ".cpp" && extension != ".h") continue;
      std::ifstream in(entry.path());
      const std::string text{std::istreambuf_iterator<char>(in), {}};
      constexpr std::string_view kThrow = "InputError(";
      for (std::size_t at = text.find(kThrow); at != std::string::npos; at = text.find(kThrow, at + 1)) {
        const std::vector<std::string> arguments = Arguments(text, at + kThrow.size());
        if (arguments.size() < 2) continue;  // a declaration, a comment
        ++found;
        EXPECT_TRUE(arguments.size() == 3 && arguments[2] != "\"\"")
            << entry.path() << ": InputError(" << arguments[0] << ", " << arguments[1];
        if (arguments.size() != 3) continue;
        EXPECT_EQ(arguments[2].find("delete "), std::string::npos) << entry.path() << ": advice that loses data";
      }
    }
  }
  EXPECT_GT(found, 300);
}

TEST(FileSystem, NoCallThrows) {
  // What the system refuses (EACCES, ENAMETOOLONG, ELOOP ...) is a message of ours: every call takes an error_code, or
  // asks a status that was got with one.
  const std::vector<std::string> calls = {"exists",
                                          "is_directory",
                                          "is_regular_file",
                                          "file_size",
                                          "remove",
                                          "remove_all",
                                          "create_directories",
                                          "create_directory",
                                          "rename",
                                          "absolute",
                                          "canonical",
                                          "weakly_canonical",
                                          "resize_file",
                                          "copy_file",
                                          "status",
                                          "symlink_status",
                                          "read_symlink",
                                          "current_path",
                                          "temp_directory_path"};
  int found = 0;
  for (const std::string room :
       {"core", "planner", "policies", "execution", "env", "cad", "perception", "workflow", "evaluation", "cli"}) {
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(FEELER_SOURCE_DIR) / room)) {
      if (!entry.is_regular_file()) continue;
      std::ifstream in(entry.path());
      const std::string text{std::istreambuf_iterator<char>(in), {}};
      for (const std::string& name : calls) {
        for (const std::string space : {"fs::", "filesystem::"}) {
          const std::string call = space + name + "(";
          for (std::size_t at = text.find(call); at != std::string::npos; at = text.find(call, at + 1)) {
            ++found;
            const std::string last = Arguments(text, at + call.size()).back();
            const bool asked = last == "error" || last == "ignored" || last == "ec" || last == "status" ||
                               last.starts_with("fs::symlink_status(") || last.starts_with("fs::status(");
            EXPECT_TRUE(asked) << entry.path() << ": " << call << "... " << last;
          }
        }
      }
    }
  }
  EXPECT_GT(found, 50);
}

TEST(JsonDepth, EveryTextIsReadByAReaderThatLimitsIt) {
  // The helper; the two readers that name keys and limit depth while they read; a text of our own in the program.
  const std::set<std::string> readers = {"core/json_depth.h", "policies/io/json_input.cpp", "perception/input_file.cpp",
                                         "execution/remote/protocol/schema.cpp"};
  for (const std::string room : {"core", "planner", "policies", "execution", "env", "cad", "perception", "workflow",
                                 "evaluation", "cli", "python/src"}) {
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(FEELER_SOURCE_DIR) / room)) {
      const std::string name = fs::relative(entry.path(), FEELER_SOURCE_DIR).string();
      if (!entry.is_regular_file() || readers.contains(name)) continue;
      std::ifstream in(entry.path());
      const std::string text{std::istreambuf_iterator<char>(in), {}};
      for (const char* call : {"json::parse(", "json::accept(", "json::sax_parse("}) {
        EXPECT_EQ(text.find(call), std::string::npos) << name << " reads JSON of any depth; use ParseJsonText";
      }
    }
  }
}

TEST(JsonDepth, WhatIsTooDeepIsDiscarded) {
  EXPECT_TRUE(ParseJsonText<nlohmann::json>(std::string(100000, '[')).is_discarded());
  EXPECT_TRUE(ParseJsonText<nlohmann::json>("{\"a\": [1, ").is_discarded());
  EXPECT_EQ(ParseJsonText<nlohmann::json>("{\"a\": [1]}").at("a").size(), 1U);
}

}  // namespace
}  // namespace feeler
