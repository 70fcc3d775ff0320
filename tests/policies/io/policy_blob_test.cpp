// Laws of the policy blob:
// - decode(encode(p)) = p in every field, doubles bit for bit, for uniform and arbitrary probabilities;
// - a blob with any one byte changed, any bit flipped, or cut off anywhere is refused with InputError;
// - bytes of any kind, a right checksum included, give a lawful policy or InputError, never anything else;
// - uniform policies take few bytes a node;
// - FindPolicyFault names each kind of broken law.
#include "feeler/policies/io/policy_blob.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <functional>

#include "feeler/core/error.h"
#include "feeler/policies/io/bytes.h"
#include "feeler/policies/io/policy_check.h"
#include "tests/policies/random_policy.h"

namespace feeler::policies {
namespace {

using planner::PolicyGraph;

TEST(PolicyBlob, RoundTripsEveryField) {
  for (std::uint64_t episode = 0; episode < 300; ++episode) {
    RandomStream random(1, episode, "policy");
    const PolicyGraph policy = RandomPolicy(random, 1 + random.Index(200), episode % 2 == 0);
    ASSERT_EQ(FindPolicyFault(policy), std::nullopt);
    const std::string blob = EncodePolicyBlob(policy);
    EXPECT_TRUE(Identical(DecodePolicyBlob(blob, "test"), policy)) << "episode " << episode;
    EXPECT_EQ(EncodePolicyBlob(policy), blob);
  }
}

TEST(PolicyBlob, KeepsCostsThatAreNoFractions) {
  RandomStream random(2, 0, "policy");
  PolicyGraph policy = RandomPolicy(random, 40, true);
  for (planner::PolicyNode& node : policy.nodes) {
    if (!node.is_leaf()) node.expected_cost = random.Uniform(0.0, 1e9);
  }
  policy.expected_cost = policy.nodes[policy.root].expected_cost;
  policy.lower_bound = 0x1.fffffffffffffp-1000;
  EXPECT_TRUE(Identical(DecodePolicyBlob(EncodePolicyBlob(policy), "test"), policy));
}

TEST(PolicyBlob, IsSmall) {
  RandomStream random(3, 0, "policy");
  const PolicyGraph policy = RandomPolicy(random, 1000, true);
  const double bytes_per_node = static_cast<double>(EncodePolicyBlob(policy).size()) / 1000.0;
  RecordProperty("bytes_per_node", std::to_string(bytes_per_node));
  // Random graphs hardly compress; those of the planner do better.
  EXPECT_LT(bytes_per_node, 16.0);
}

TEST(PolicyBlob, DetectsEveryAlteredByteAndEveryCut) {
  RandomStream random(4, 0, "policy");
  const std::string blob = EncodePolicyBlob(RandomPolicy(random, 60, false));
  for (std::size_t at = 0; at < blob.size(); ++at) {
    EXPECT_THROW(DecodePolicyBlob(blob.substr(0, at), "test"), InputError) << "cut at " << at;
    for (int bit = 0; bit < 9; ++bit) {
      std::string altered = blob;
      altered[at] = static_cast<char>(altered[at] ^ (bit < 8 ? 1 << bit : 0xFF));
      EXPECT_THROW(DecodePolicyBlob(altered, "test"), InputError) << "byte " << at << " bit " << bit;
    }
  }
  EXPECT_THROW(DecodePolicyBlob(blob + '\0', "test"), InputError);
}

/// A blob around any payload, checksum and lengths right.
std::string Wrap(const std::string& payload) {
  ByteWriter size;
  size.Varint(payload.size());
  uLongf length = compressBound(payload.size());
  std::string deflated(length, '\0');
  compress(reinterpret_cast<Bytef*>(deflated.data()), &length, reinterpret_cast<const Bytef*>(payload.data()),
           payload.size());
  deflated.resize(length);
  const std::string head = std::string("FPOL") + '\1';
  const std::string tail = size.bytes() + deflated;
  const std::string covered = head + tail;
  ByteWriter checksum;
  checksum.Fixed32(static_cast<std::uint32_t>(
      crc32(0, reinterpret_cast<const Bytef*>(covered.data()), static_cast<uInt>(covered.size()))));
  return head + checksum.bytes() + tail;
}

std::string Unwrap(const std::string& blob) {
  ByteReader body(std::string_view(blob).substr(9));
  uLongf size = body.Varint();
  std::string payload(size, '\0');
  uncompress(reinterpret_cast<Bytef*>(payload.data()), &size, reinterpret_cast<const Bytef*>(body.rest().data()),
             body.rest().size());
  return payload;
}

TEST(PolicyBlob, SurvivesTwentyThousandForgeries) {
  std::vector<std::string> payloads;
  for (std::uint64_t i = 0; i < 20; ++i) {
    RandomStream random(5, i, "policy");
    const std::string blob = EncodePolicyBlob(RandomPolicy(random, 2 + 2 * i, i % 2 == 0));
    payloads.push_back(Unwrap(blob));
    ASSERT_EQ(Wrap(payloads.back()).substr(0, 4), blob.substr(0, 4));
    ASSERT_NO_THROW(DecodePolicyBlob(Wrap(payloads.back()), "test"));
  }
  int accepted = 0;
  for (std::uint64_t episode = 0; episode < 22000; ++episode) {
    RandomStream random(6, episode, "forgery");
    const std::string payload = Mutate(payloads[random.Index(payloads.size())], random);
    try {
      const PolicyGraph policy = DecodePolicyBlob(Wrap(payload), "test");
      ASSERT_EQ(FindPolicyFault(policy), std::nullopt);
      ++accepted;
    } catch (const InputError&) {
    }
  }
  // Some forgeries are lawful policies (a changed direction): the checks let those through that they should.
  EXPECT_GT(accepted, 100);
  for (std::uint64_t episode = 0; episode < 2000; ++episode) {
    RandomStream random(7, episode, "noise");
    std::string noise(random.Index(200), '\0');
    for (char& c : noise) c = static_cast<char>(random.Index(256));
    EXPECT_THROW(DecodePolicyBlob(noise, "test"), InputError);
  }
}

TEST(PolicyBlob, RefusesLyingLengths) {
  ByteWriter payload;
  payload.Varint(std::uint64_t{1} << 40);  // nodes
  EXPECT_THROW(DecodePolicyBlob(Wrap(payload.bytes()), "test"), InputError);
  ByteWriter branches;
  branches.Varint(1);
  branches.Varint(0);
  branches.Varint(std::uint64_t{6} << 50);
  EXPECT_THROW(DecodePolicyBlob(Wrap(branches.bytes()), "test"), InputError);
}

TEST(PolicyCheck, NamesEachBrokenLaw) {
  RandomStream random(8, 0, "policy");
  const PolicyGraph lawful = RandomPolicy(random, 60, true);
  const auto inner = [](PolicyGraph& p) -> planner::PolicyNode& { return p.nodes[p.root]; };
  const auto leaf = [](PolicyGraph& p) -> planner::PolicyNode& {
    return *std::find_if(p.nodes.begin(), p.nodes.end(), [](const planner::PolicyNode& n) { return n.is_leaf(); });
  };
  const std::vector<std::pair<const char*, std::function<void(PolicyGraph&)>>> faults = {
      {"no nodes", [](PolicyGraph& p) { p.nodes.clear(); }},
      {"root", [](PolicyGraph& p) { p.root = 60; }},
      {"expected cost", [](PolicyGraph& p) { p.expected_cost = std::nan(""); }},
      {"not that of the root", [](PolicyGraph& p) { p.expected_cost += 1.0; }},
      {"lower bound exceeds", [](PolicyGraph& p) { p.lower_bound = p.expected_cost + 1.0; }},
      {"negative cost",
       [&](PolicyGraph& p) { inner(p).expected_cost = -1e-12, p.expected_cost = p.lower_bound = 0.0; }},
      {"does not exist", [&](PolicyGraph& p) { inner(p).branches[0].next = 60; }},
      {"cycle", [&](PolicyGraph& p) { inner(p).branches[0].next = p.root; }},
      {"move length", [&](PolicyGraph& p) { inner(p).move.cells = 0; }},
      {"longer than its move", [&](PolicyGraph& p) { inner(p).branches[0].outcome.cells = 1000; }},
      {"contact flag", [&](PolicyGraph& p) { inner(p).branches[0].outcome.contact ^= true; }},
      {"probability", [&](PolicyGraph& p) { inner(p).branches[0].probability = 0.0; }},
      {"sum to 1", [&](PolicyGraph& p) { inner(p).branches[0].probability *= 0.5; }},
      {"shift", [&](PolicyGraph& p) { inner(p).branches[0].shift.x() = 1 << 30; }},
      {"both branches and hypotheses", [&](PolicyGraph& p) { inner(p).leaf.push_back({}); }},
      {"same outcome twice", [&](PolicyGraph& p) { inner(p).branches.push_back(inner(p).branches[0]); }},
      {"neither", [&](PolicyGraph& p) { leaf(p).leaf.clear(); }},
      {"twice", [&](PolicyGraph& p) { leaf(p).leaf.push_back(leaf(p).leaf[0]); }},
      {"leaf with a cost", [&](PolicyGraph& p) { leaf(p).expected_cost = 1.0; }},
      {"orientation", [&](PolicyGraph& p) { leaf(p).leaf[0].orientation = -1; }},
  };
  for (const auto& [text, breaks] : faults) {
    PolicyGraph policy = lawful;
    breaks(policy);
    const auto fault = FindPolicyFault(policy);
    ASSERT_TRUE(fault) << text;
    EXPECT_NE(fault->find(text), std::string::npos) << *fault << " instead of " << text;
    EXPECT_THROW(EncodePolicyBlob(policy), std::invalid_argument);
  }
}

}  // namespace
}  // namespace feeler::policies
