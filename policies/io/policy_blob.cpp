#include "feeler/policies/io/policy_blob.h"

#include <zlib.h>

#include <bit>
#include <cmath>
#include <stdexcept>

#include "feeler/core/error.h"
#include "feeler/policies/io/bytes.h"
#include "feeler/policies/io/policy_check.h"

namespace feeler::policies {
namespace {

using planner::PolicyBranch;
using planner::PolicyGraph;
using planner::PolicyLeaf;
using planner::PolicyNode;

constexpr std::string_view kMagic = "FPOL";
constexpr char kVersion = 1;
constexpr std::size_t kChecksumAt = 5;  // after magic and version
constexpr std::size_t kBodyAt = 9;
constexpr std::uint64_t kMaxPayload = std::uint64_t{1} << 26;
constexpr std::uint64_t kMaxDeflateRatio = 1100;  // deflate cannot do better than 1032 to 1

std::uint32_t Crc32(std::uint32_t crc, std::string_view bytes) {
  return static_cast<std::uint32_t>(
      crc32_z(crc, reinterpret_cast<const unsigned char*>(bytes.data()), static_cast<z_size_t>(bytes.size())));
}

/// Over all of the blob but the checksum itself.
std::uint32_t Checksum(std::string_view blob) {
  return Crc32(Crc32(0, blob.substr(0, kChecksumAt)), blob.substr(kBodyAt));
}

// --- doubles that are mostly fractions ------------------------------------------------------------------------------
// With a uniform prior over n hypotheses every probability and every cost to go is K / n. Such a value is stored as K
// and the distance in units of last place from the correctly rounded quotient (a sum of rounded terms may be off by a
// few); any other as its 8 bytes. Both restore the same bits.

enum Spelling : std::uint64_t { kQuotient = 0, kNearQuotient = 1, kRaw = 2 };
constexpr double kMaxNumerator = 0x1.0p50;
constexpr std::int64_t kMaxUlps = 1 << 12;

void WriteFraction(ByteWriter& out, double value, std::uint64_t denominator) {
  const double n = static_cast<double>(denominator);
  const double product = value * n;
  if (product >= 0.0 && product < kMaxNumerator) {
    const auto numerator = static_cast<std::uint64_t>(std::llround(product));
    const double quotient = static_cast<double>(numerator) / n;
    const std::int64_t ulps = std::bit_cast<std::int64_t>(value) - std::bit_cast<std::int64_t>(quotient);
    if (ulps == 0) return out.Varint(numerator << 2 | kQuotient);
    if (ulps > -kMaxUlps && ulps < kMaxUlps) {
      out.Varint(numerator << 2 | kNearQuotient);
      return out.Signed(ulps);
    }
  }
  out.Varint(kRaw);
  out.Double(value);
}

double ReadFraction(ByteReader& in, std::uint64_t denominator) {
  const std::uint64_t head = in.Varint();
  if ((head & 3) == kRaw) return in.Double();
  const double quotient = static_cast<double>(head >> 2) / static_cast<double>(denominator);
  if ((head & 3) == kQuotient) return quotient;
  const std::int64_t ulps = in.Signed();
  return std::bit_cast<double>(std::bit_cast<std::uint64_t>(quotient) + static_cast<std::uint64_t>(ulps));
}

// --- payload: column by column, so that like numbers stand together for deflate --------------------------------------

std::string EncodePayload(const PolicyGraph& policy) {
  ByteWriter out;
  out.Varint(policy.nodes.size());
  out.Varint(policy.root);
  for (const PolicyNode& node : policy.nodes) {
    const auto direction = node.is_leaf() ? 0U : static_cast<unsigned>(IndexOf(node.move.direction));
    out.Varint(node.branches.size() * kDirectionCount + direction);
  }
  for (const PolicyNode& node : policy.nodes) {
    if (!node.is_leaf()) out.Varint(static_cast<std::uint64_t>(node.move.cells));
  }
  for (const PolicyNode& node : policy.nodes) {
    for (const PolicyBranch& branch : node.branches) {
      out.Varint(static_cast<std::uint64_t>(node.move.cells - branch.outcome.cells));
    }
  }
  for (std::size_t i = 0; i < policy.nodes.size(); ++i) {
    for (const PolicyBranch& branch : policy.nodes[i].branches) {
      out.Signed(std::int64_t{branch.next} - static_cast<std::int64_t>(i));
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    for (const PolicyNode& node : policy.nodes) {
      for (const PolicyBranch& branch : node.branches) out.Signed(branch.shift[axis]);
    }
  }
  for (const PolicyNode& node : policy.nodes) {
    if (!node.is_leaf()) continue;
    out.Varint(node.leaf.size());
    for (const PolicyLeaf& leaf : node.leaf) {
      for (int axis = 0; axis < 3; ++axis) out.Signed(leaf.offset[axis]);
      out.Varint(static_cast<std::uint64_t>(leaf.orientation));
    }
  }
  // A leaf has no move, but its fields round-trip as well.
  for (const PolicyNode& node : policy.nodes) {
    if (!node.is_leaf()) continue;
    out.Varint(static_cast<std::uint64_t>(IndexOf(node.move.direction)));
    out.Signed(node.move.cells);
  }
  const auto counts = LeafCounts(policy, *ChildrenFirst(policy));
  for (std::size_t i = 0; i < policy.nodes.size(); ++i) {
    for (const PolicyBranch& branch : policy.nodes[i].branches) {
      // The numerator is the successor's count: storing the difference, nearly always zero, costs nothing.
      const double expected = static_cast<double>(counts[branch.next]) / static_cast<double>(counts[i]);
      const bool as_expected =
          std::bit_cast<std::uint64_t>(expected) == std::bit_cast<std::uint64_t>(branch.probability);
      out.Varint(as_expected ? 0 : 1);
      if (!as_expected) WriteFraction(out, branch.probability, counts[i]);
    }
  }
  for (std::size_t i = 0; i < policy.nodes.size(); ++i) {
    if (!policy.nodes[i].is_leaf()) WriteFraction(out, policy.nodes[i].expected_cost, counts[i]);
  }
  WriteFraction(out, policy.expected_cost, counts[policy.root]);
  out.Double(policy.lower_bound);
  return out.Take();
}

/// Throws std::runtime_error with the reason if the payload is malformed.
PolicyGraph DecodePayload(std::string_view payload) {
  const auto require = [](bool condition, const char* what) {
    if (!condition) throw std::runtime_error(what);
  };
  const auto to_int = [&](std::int64_t value) {
    require(value >= -kMaxMoveCells && value <= kMaxMoveCells, "a number is out of range");
    return static_cast<int>(value);
  };
  const auto to_count = [&](std::uint64_t value) {
    require(value <= static_cast<std::uint64_t>(kMaxMoveCells), "a number is out of range");
    return static_cast<int>(value);
  };
  ByteReader in(payload);
  PolicyGraph policy;
  const std::uint64_t node_count = in.Varint();
  // Every node and every branch takes at least one byte of what remains: no allocation exceeds the input's own size.
  require(node_count >= 1 && node_count <= in.remaining() && node_count <= kMaxPolicyNodes, "the node count is wrong");
  const std::uint64_t root = in.Varint();
  require(root < node_count, "the root does not exist");
  policy.nodes.resize(node_count);
  policy.root = static_cast<std::uint32_t>(root);
  std::uint64_t branch_count = 0;
  for (PolicyNode& node : policy.nodes) {
    const std::uint64_t head = in.Varint();
    const std::uint64_t branches = head / kDirectionCount;
    branch_count += branches;
    require(branches <= payload.size() && branch_count <= payload.size(), "the branch count is wrong");
    node.branches.resize(branches);
    node.move.direction = static_cast<Direction>(head % kDirectionCount);
  }
  require(!in.failed() && branch_count <= in.remaining(), "it ends early");
  for (PolicyNode& node : policy.nodes) {
    if (!node.is_leaf()) node.move.cells = to_count(in.Varint());
  }
  for (PolicyNode& node : policy.nodes) {
    for (PolicyBranch& branch : node.branches) {
      const int shortfall = to_count(in.Varint());
      require(shortfall <= node.move.cells, "an outcome is longer than its move");
      branch.outcome = {node.move.cells - shortfall, shortfall > 0};
    }
  }
  for (std::size_t i = 0; i < policy.nodes.size(); ++i) {
    for (PolicyBranch& branch : policy.nodes[i].branches) {
      const std::int64_t step = in.Signed();
      require(step >= -std::int64_t{kMaxPolicyNodes} && step <= std::int64_t{kMaxPolicyNodes},
              "a branch is out of range");
      const std::int64_t next = static_cast<std::int64_t>(i) + step;
      require(next >= 0 && next < static_cast<std::int64_t>(node_count),
              "a branch leads to a node that does not exist");
      branch.next = static_cast<std::uint32_t>(next);
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    for (PolicyNode& node : policy.nodes) {
      for (PolicyBranch& branch : node.branches) branch.shift[axis] = to_int(in.Signed());
    }
  }
  for (PolicyNode& node : policy.nodes) {
    if (!node.is_leaf()) continue;
    const std::uint64_t size = in.Varint();
    require(size <= in.remaining(), "a leaf is too large");
    node.leaf.resize(size);
    for (PolicyLeaf& leaf : node.leaf) {
      for (int axis = 0; axis < 3; ++axis) leaf.offset[axis] = to_int(in.Signed());
      leaf.orientation = to_count(in.Varint());
    }
  }
  for (PolicyNode& node : policy.nodes) {
    if (!node.is_leaf()) continue;
    const std::uint64_t direction = in.Varint();
    require(direction < kDirectionCount, "a direction is unknown");
    node.move = {static_cast<Direction>(direction), to_int(in.Signed())};
  }
  require(!in.failed(), "it ends early");
  const auto order = ChildrenFirst(policy);
  require(order.has_value(), "the policy has a cycle");
  const auto counts = LeafCounts(policy, *order);
  for (std::size_t i = 0; i < policy.nodes.size(); ++i) {
    require(counts[i] > 0, "a node leads to no hypothesis");
    for (PolicyBranch& branch : policy.nodes[i].branches) {
      const double expected = static_cast<double>(counts[branch.next]) / static_cast<double>(counts[i]);
      branch.probability = in.Varint() == 0 ? expected : ReadFraction(in, counts[i]);
    }
  }
  for (std::size_t i = 0; i < policy.nodes.size(); ++i) {
    if (!policy.nodes[i].is_leaf()) policy.nodes[i].expected_cost = ReadFraction(in, counts[i]);
  }
  policy.expected_cost = ReadFraction(in, counts[policy.root]);
  policy.lower_bound = in.Double();
  require(!in.failed(), "it ends early");
  require(in.remaining() == 0, "bytes follow its end");
  if (const auto fault = FindPolicyFault(policy)) throw std::runtime_error(*fault);
  return policy;
}

std::string Deflate(std::string_view payload) {
  uLongf size = compressBound(static_cast<uLong>(payload.size()));
  std::string deflated(size, '\0');
  const int result = compress2(reinterpret_cast<Bytef*>(deflated.data()), &size,
                               reinterpret_cast<const Bytef*>(payload.data()), static_cast<uLong>(payload.size()), 9);
  if (result != Z_OK) throw std::bad_alloc();
  deflated.resize(size);
  return deflated;
}

/// Throws std::runtime_error unless the stream is whole and inflates to exactly `size` bytes.
std::string Inflate(std::string_view deflated, std::size_t size) {
  std::string payload(size, '\0');
  uLongf produced = static_cast<uLongf>(size);
  uLong consumed = static_cast<uLong>(deflated.size());
  const int result = uncompress2(reinterpret_cast<Bytef*>(payload.data()), &produced,
                                 reinterpret_cast<const Bytef*>(deflated.data()), &consumed);
  if (result != Z_OK || produced != size || consumed != deflated.size()) {
    throw std::runtime_error("the compressed data are malformed");
  }
  return payload;
}

}  // namespace

std::string EncodePolicyBlob(const PolicyGraph& policy) {
  if (const auto fault = FindPolicyFault(policy)) throw std::invalid_argument("EncodePolicyBlob: " + *fault);
  const std::string payload = EncodePayload(policy);
  if (payload.size() > kMaxPayload) throw std::invalid_argument("EncodePolicyBlob: the policy is too large");
  ByteWriter body;
  body.Varint(payload.size());
  std::string blob(kMagic);
  blob.push_back(kVersion);
  blob.append(kBodyAt - kChecksumAt, '\0');
  blob += body.bytes();
  blob += Deflate(payload);
  ByteWriter checksum;
  checksum.Fixed32(Checksum(blob));
  blob.replace(kChecksumAt, kBodyAt - kChecksumAt, checksum.bytes());
  return blob;
}

PolicyGraph DecodePolicyBlob(std::string_view blob, const std::string& where) {
  const auto fail = [&](const std::string& what, const char* mend) { return InputError(where, what, mend); };
  constexpr const char* kMend = "make it again, or restore it from a copy";
  if (blob.size() <= kBodyAt || blob.substr(0, kMagic.size()) != kMagic) throw fail("not a policy blob", kMend);
  if (blob[kMagic.size()] != kVersion) {
    throw fail("policy blob of unknown version " + std::to_string(static_cast<unsigned char>(blob[kMagic.size()])),
               "use the version of feeler that wrote it");
  }
  if (ByteReader(blob.substr(kChecksumAt)).Fixed32() != Checksum(blob)) {
    throw fail("policy blob is cut off or altered (its checksum is wrong)", kMend);
  }
  try {
    ByteReader body(blob.substr(kBodyAt));
    const std::uint64_t size = body.Varint();
    if (body.failed() || size == 0 || size > kMaxPayload || size / kMaxDeflateRatio > body.remaining()) {
      throw std::runtime_error("its length is wrong");
    }
    return DecodePayload(Inflate(body.rest(), size));
  } catch (const std::runtime_error& error) {
    throw fail(std::string("policy blob is malformed: ") + error.what(), kMend);
  }
}

}  // namespace feeler::policies
