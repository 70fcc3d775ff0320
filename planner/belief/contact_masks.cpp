#include "feeler/planner/belief/contact_masks.h"

#include <unordered_map>
#include <utility>
#include <vector>

#include "feeler/planner/arrays/row_dictionary.h"

namespace feeler::planner {
namespace {

constexpr int kMaskWindow = 16;

struct HashBits {
  std::size_t operator()(const Bits256& b) const {
    std::uint64_t hash = 0x9E3779B97F4A7C15;
    for (const std::uint64_t w : b.word) {
      hash = (hash ^ w) * 0xFF51AFD7ED558CCD;
      hash ^= hash >> 32;
    }
    return static_cast<std::size_t>(hash);
  }
};

/// True where the step is blocked and the tool can be there at all: outside the target, or where a step free by the map
/// leads.
bool StepMatters(const ContactMap& map, const Cell& displacement, Direction d, int orientation) {
  if (map.StepFree(displacement, d, orientation)) return false;
  if (!map.Blocked(displacement, orientation)) return true;
  for (const Direction from : kDirections) {
    const Cell before = displacement - UnitCell(from);
    if (!map.Blocked(before, orientation) && map.StepFree(before, from, orientation)) return true;
  }
  return false;
}

}  // namespace

ContactMasks::ContactMasks(const ContactMap& map, const ArrayStore* store) {
  // One cell beyond the map's domain everything repeats, save steps back into it; a window reaches 15 cells down from
  // its corner.
  domain_ = {map.domain().min - Cell::Ones(), map.domain().max + Cell(kMaskWindow, kMaskWindow, 1)};
  size_ = domain_.Size();
  if (store != nullptr && store->Take<std::uint32_t>("mask indices", {&row_, &index_}) &&
      store->Take<Bits256>("masks", {&masks_})) {
    return;
  }
  Fill(map);
  if (store == nullptr) return;
  store->Keep<std::uint32_t>("mask indices", {&row_, &index_});
  store->Keep<Bits256>("masks", {&masks_});
}

void ContactMasks::Fill(const ContactMap& map) {
  std::vector<std::uint32_t> rows;
  RowDictionary<std::uint32_t> index(static_cast<std::size_t>(size_.x()));
  std::vector<std::uint32_t> of_row(static_cast<std::size_t>(size_.x()));
  std::vector<Bits256> masks(1);
  std::unordered_map<Bits256, std::uint32_t, HashBits> known = {{Bits256{}, 0}};
  const CellBox sampled = {domain_.min, map.domain().max + Cell::Ones()};
  for (int o = 0; o < map.orientations(); ++o) {
    for (const Direction d : kDirections) {
      for (int z = 0; z < size_.z(); ++z) {
        std::vector<Bits256> column(static_cast<std::size_t>(size_.x()));
        for (int y = 1 - kMaskWindow; y < size_.y(); ++y) {
          const auto blocked = [&](int x) {
            return StepMatters(map, sampled.Clamp(domain_.min + Cell(x, y, z)), d, o);
          };
          std::uint64_t row = 0;
          bool last = blocked(0);
          if (last) row = 0xFFFF;
          for (int x = 0; x < size_.x(); ++x) {
            if (domain_.min.x() + x <= sampled.max.x()) last = blocked(x);
            row = (row << 1 | (last ? 1U : 0U)) & 0xFFFF;
            Bits256& mask = column[static_cast<std::size_t>(x)];
            mask = mask.Up(kMaskWindow);
            mask.word[0] |= row;
            if (y < 0) continue;
            const auto [at, added] = known.try_emplace(mask, static_cast<std::uint32_t>(masks.size()));
            if (added) masks.push_back(mask);
            of_row[static_cast<std::size_t>(x)] = at->second;
          }
          if (y >= 0) rows.push_back(index.Add(of_row));
        }
      }
    }
  }
  row_ = std::move(rows);
  index_ = index.Release();
  masks_ = std::move(masks);
}

}  // namespace feeler::planner
