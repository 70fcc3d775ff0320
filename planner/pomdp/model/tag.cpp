#include "feeler/planner/pomdp/model/tag.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "feeler/core/error.h"

namespace feeler::planner {
namespace {

using Place = std::pair<int, int>;  // x to the east, y to the south

struct Room {
  std::vector<Place> cells;
  std::map<Place, std::uint32_t> number;
  std::uint32_t start = 0;

  /// Where a step from a cell leads: nowhere against a wall.
  std::uint32_t Step(std::uint32_t cell, int dx, int dy) const {
    const auto found = number.find({cells[cell].first + dx, cells[cell].second + dy});
    return found == number.end() ? cell : found->second;
  }
};

Room Read(const TagRoom& tag) {
  Room room;
  int starts = 0;
  for (std::size_t y = 0; y < tag.plan.size(); ++y) {
    if (tag.plan[y].size() != tag.plan[0].size()) {
      throw InputError("Tag", fmt::format("row {} of the plan is not as long as the first", y), "make rows equal");
    }
    for (std::size_t x = 0; x < tag.plan[y].size(); ++x) {
      const char c = tag.plan[y][x];
      if (c == '#') continue;
      if (c != '.' && c != 'R') throw InputError("Tag", "the plan holds an unknown character", "use . # and R");
      const Place place{static_cast<int>(x), static_cast<int>(y)};
      if (c == 'R') {
        ++starts;
        room.start = static_cast<std::uint32_t>(room.cells.size());
      }
      room.number[place] = static_cast<std::uint32_t>(room.cells.size());
      room.cells.push_back(place);
    }
  }
  if (starts != 1 || room.cells.size() < 2) {
    throw InputError("Tag", fmt::format("{} starts and {} cells", starts, room.cells.size()),
                     "give one R, and two cells or more");
  }
  const double cells = static_cast<double>(room.cells.size());
  RequireFits("Tag", cells * cells + 1.0, 5.0, 5.0 * 5.0 * (cells * cells + 1.0));
  return room;
}

/// Where the opponent goes with the robot at `robot`.
std::vector<SparseEntry> Flees(const Room& room, std::uint32_t robot, std::uint32_t opponent) {
  constexpr double kAlong = 0.4;
  std::map<std::uint32_t, double> to = {{opponent, 1.0 - 2.0 * kAlong}};
  const auto along = [&](int difference, int dx, int dy) {
    if (difference >= 0) to[room.Step(opponent, dx, dy)] += difference == 0 ? 0.5 * kAlong : kAlong;
    if (difference <= 0) to[room.Step(opponent, -dx, -dy)] += difference == 0 ? 0.5 * kAlong : kAlong;
  };
  along(room.cells[opponent].first - room.cells[robot].first, 1, 0);
  along(room.cells[opponent].second - room.cells[robot].second, 0, 1);
  std::vector<SparseEntry> row;
  row.reserve(to.size());
  for (const auto& [cell, probability] : to) row.push_back({cell, probability});
  return row;
}

}  // namespace

Pomdp MakeTag(const TagRoom& tag) {
  const Room room = Read(tag);
  const auto count = static_cast<std::uint32_t>(room.cells.size());
  const std::uint32_t tagged = count * count;
  const auto name = [&](std::uint32_t cell) {
    return fmt::format("x{}y{}", room.cells[cell].first, room.cells[cell].second);
  };
  Pomdp pomdp;
  pomdp.name = fmt::format("Tag_{}", count);
  pomdp.discount = tag.discount;
  pomdp.actions = {"north", "south", "east", "west", "tag"};
  for (std::uint32_t r = 0; r < count; ++r) {
    for (std::uint32_t o = 0; o < count; ++o) pomdp.states.push_back(fmt::format("r{}_o{}", name(r), name(o)));
  }
  pomdp.states.emplace_back("tagged");
  for (std::uint32_t r = 0; r < count; ++r) pomdp.observations.push_back(name(r));
  for (std::uint32_t r = 0; r < count; ++r) pomdp.observations.push_back(name(r) + "_seen");
  pomdp.observations.emplace_back("end");

  constexpr std::array<std::pair<int, int>, 4> kSteps = {{{0, -1}, {0, 1}, {1, 0}, {-1, 0}}};
  const SparseEntry end{tagged, 1.0};
  for (std::size_t a = 0; a < pomdp.actions.size(); ++a) {
    for (std::uint32_t s = 0; s <= tagged; ++s) {
      const std::uint32_t robot = s / count;
      const std::uint32_t opponent = s % count;
      const SparseEntry seen{s == tagged ? 2 * count : robot == opponent ? count + robot : robot, 1.0};
      pomdp.observation_rows.Append({&seen, 1});
      const bool catches = a == kSteps.size() && robot == opponent;
      if (s == tagged || catches) {
        pomdp.transitions.Append({&end, 1});
        pomdp.reward.push_back(s == tagged ? 0.0 : 10.0);
        continue;
      }
      const bool moves = a < kSteps.size();
      const std::uint32_t next = moves ? room.Step(robot, kSteps[a].first, kSteps[a].second) : robot;
      std::vector<SparseEntry> row = Flees(room, robot, opponent);
      for (SparseEntry& e : row) e.index += next * count;
      pomdp.transitions.Append(row);
      pomdp.reward.push_back(moves ? -1.0 : -10.0);
    }
  }
  for (std::uint32_t o = 0; o < count; ++o) {
    if (o != room.start) pomdp.start.push_back({room.start * count + o, 1.0 / (count - 1)});
  }
  return pomdp;
}

}  // namespace feeler::planner
