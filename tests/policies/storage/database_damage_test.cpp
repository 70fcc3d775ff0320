// Damage to a database file, byte by byte. Law: whatever byte is altered and wherever the file is cut off, each of the
// following either throws InputError or gives what it gave before: Get of every problem (a stored problem is never
// silently another one, nor missing), the content digest, and Verify followed by all of them; a writer never continues
// a file whose content is damaged. No side files appear.
#include <gtest/gtest.h>

#include "tests/policies/storage/database_fixture.h"

namespace feeler::policies {
namespace {

class DatabaseDamageTest : public DatabaseFixture {
 protected:
  void SetUp() override {
    DatabaseFixture::SetUp();
    problems_ = RandomProblems(6, 1);
    Database database = Database::Create(path(), Identity());
    for (const StoredProblem& problem : problems_) database.Put(problem);
    digest_ = database.ContentDigest();
  }

  /// What became of the damaged file: detected, or harmless.
  bool Detected() {
    try {
      Database database = Database::OpenReadOnly(path());
      bool detected = false;
      for (const StoredProblem& problem : problems_) {
        try {
          const auto found = database.Get(problem.extents);
          if (!found || !Same(*found, problem)) ADD_FAILURE() << "another problem was returned for a stored one";
        } catch (const InputError&) {
          detected = true;
        }
      }
      try {
        if (database.ContentDigest() != digest_) ADD_FAILURE() << "the digest changed silently";
      } catch (const InputError&) {
        detected = true;
      }
      try {
        database.Verify();
        if (detected) ADD_FAILURE() << "Verify overlooked what was detected before";
      } catch (const InputError&) {
        detected = true;
      }
      return detected;
    } catch (const InputError&) {
      return true;
    }
  }

  std::vector<StoredProblem> problems_;
  std::string digest_;
};

TEST_F(DatabaseDamageTest, EveryAlteredByteIsDetectedOrHarmless) {
  const std::string whole = ReadBytes(path());
  RandomStream random(1, 0, "damage");
  int detected = 0, harmless = 0;
  // Every byte of the header and of all that is not zero, but every third of the policies; some of the unused space.
  for (std::size_t at = 0; at < whole.size(); at += at < 100 ? 1 : whole[at] == 0 ? 31 : at < 8192 ? 1 : 3) {
    std::string altered = whole;
    altered[at] = static_cast<char>(altered[at] ^ (1 + random.Index(255)));
    WriteBytes(path(), altered);
    (Detected() ? detected : harmless) += 1;
    ASSERT_FALSE(HasFailure()) << "byte " << at << " of " << whole.size();
    ASSERT_EQ(FilesInFolder(), std::vector<std::string>{"test.db"});
  }
  std::cout << detected << " detected, " << harmless << " harmless (unused space) of " << whole.size() << " bytes\n";
  EXPECT_GT(detected, harmless / 4);
}

TEST_F(DatabaseDamageTest, AWriterNeverContinuesADamagedFile) {
  const std::string whole = ReadBytes(path());
  for (std::size_t at = 0; at < whole.size(); at += 97) {
    std::string altered = whole;
    altered[at] = static_cast<char>(altered[at] ^ 0x10);
    WriteBytes(path(), altered);
    try {
      Database database = Database::OpenForAppend(path(), Identity());
      EXPECT_EQ(database.ContentDigest(), digest_) << "byte " << at;
    } catch (const InputError&) {
    }
  }
}

TEST_F(DatabaseDamageTest, EveryCutIsDetected) {
  const std::string whole = ReadBytes(path());
  for (std::size_t length = 0; length < whole.size(); length += length < 200 ? 1 : 509) {
    WriteBytes(path(), whole.substr(0, length));
    EXPECT_THROW(Database::OpenReadOnly(path()), InputError) << "cut at " << length;
    if (length > 0) {
      EXPECT_THROW(Database::OpenForAppend(path(), Identity()), InputError) << "cut at " << length;
      EXPECT_TRUE(ReadBytes(path()) == whole.substr(0, length)) << "the damaged file was changed";
    }
  }
}

}  // namespace
}  // namespace feeler::policies
