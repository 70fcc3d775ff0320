#include "feeler/execution/contact/confirm.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "feeler/execution/contact/continuous_travel.h"
#include "feeler/execution/contact/free_path.h"

namespace feeler::execution {
namespace {

/// A probe begins this far from the wall it expects, in cells: room for the uncertainty of the axis.
constexpr double kNearest = 1.5;
constexpr double kFarthest = 3.5;
/// The wall is looked for at least this far behind where it is expected, in cells: the fit may be surer than it is
/// right.
constexpr double kLeastSlack = 1.5;
/// A contact after a shorter motion may be the wall that the tool has just come off, in cells.
constexpr double kLeastTold = 0.25;
/// Touches of one axis, however tight the limit.
constexpr int kMostContacts = 4;
/// After a blocked path the tool comes out by this, in cells.
constexpr double kComeOut = 2.0;
/// Of a cell, in units of the time of a motion of one cell from rest to rest (see FindFreePath).
constexpr double kTimeOfProbing = 0.5;
/// Lines that meet the same wall differ by less than this.
constexpr double kSameWall = 0.2;

bool IsBroadWall(const planner::ContactMap& map, const Cell& from, Direction direction, int orientation) {
  const double travel = map.Travel(from, direction, orientation);
  if (travel < kNearest || travel > kFarthest) return false;
  const int u = (AxisOf(direction) + 1) % 3;
  const int v = (AxisOf(direction) + 2) % 3;
  for (int i = -1; i <= 1; ++i) {
    for (int j = -1; j <= 1; ++j) {
      Cell line = from;
      line[u] += i;
      line[v] += j;
      if (map.Blocked(line, orientation)) return false;
      if (std::abs(map.Travel(line, direction, orientation) - travel) > kSameWall) return false;
    }
  }
  return true;
}

/// Contacts per axis across the insertion that met flat ground: the lines beside the touch, to both sides across the
/// insertion, meet the same wall. Nearer to an edge of tool or target, a bevel or round narrower than a cell is read
/// instead of the wall, and the contact map does not show it.
std::array<int, 3> ContactsOnFlatGround(const planner::ContactMap& map, const std::vector<Touch>& evidence,
                                        const TargetFit& fit, Direction insertion, int orientation,
                                        const FitOptions& options) {
  std::array<int, 3> contacts{};
  for (const Touch& touch : evidence) {
    const int axis = AxisOf(touch.direction);
    if (!touch.contact || touch.is_oblique() || axis == AxisOf(insertion)) continue;
    const Eigen::Vector3d displacement = touch.start - fit.position;
    const auto travel_beside = [&](int cells) {
      Eigen::Vector3d line = displacement;
      line[3 - axis - AxisOf(insertion)] += cells;
      return ContinuousTravel(map, line, touch.direction, orientation);
    };
    const double travel = travel_beside(0);
    if (std::abs(touch.travelled - travel) > options.violation_cells + options.step_cells) continue;
    if (std::abs(travel_beside(1) - travel) > kSameWall || std::abs(travel_beside(-1) - travel) > kSameWall) continue;
    ++contacts[static_cast<std::size_t>(axis)];
  }
  return contacts;
}

TargetFit BestFit(const planner::ContactMap& map, const std::vector<Touch>& evidence, const Region& likely,
                  const Region& possible, int orientation, const FitOptions& options) {
  const TargetFit near = FitTarget(map, evidence, likely.lower, likely.upper, orientation, options);
  if (near.violations == 0) return near;
  const TargetFit far = FitTargetAnywhere(map, evidence, possible.lower, possible.upper, orientation, options);
  return far.violations < near.violations ? far : near;
}

/// The axis across the insertion that is most in need of a touch; -1 if none is. An axis that no face has pinned is
/// felt even where edges and slanted walls leave it narrow: what they tell hangs on the other axes, and one edge met on
/// the wrong side of a tie would put the whole estimate off by cells.
int LoosestAxis(const TargetFit& fit, const std::array<int, 3>& contacts, Direction insertion,
                const std::array<bool, 3>& hopeless, int contacts_wanted) {
  int loosest = -1;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    if (axis == AxisOf(insertion) || contacts[i] >= contacts_wanted || hopeless[i]) continue;
    if (loosest < 0 || contacts[i] < contacts[static_cast<std::size_t>(loosest)] ||
        (contacts[i] == contacts[static_cast<std::size_t>(loosest)] &&
         fit.half_width[axis] > fit.half_width[loosest])) {
      loosest = axis;
    }
  }
  return loosest;
}

/// One contact tells a wall about as well as a shortfall tells a contact; the mean of n of them sqrt(n) times better.
int ContactsWanted(const ExecutorOptions& options) {
  const double ratio = options.shortfall_m / options.confirm_limit_m;
  return std::clamp(static_cast<int>(std::ceil(ratio * ratio - 1e-9)), 1, kMostContacts);
}

}  // namespace

std::optional<ConfirmingTouch> PlanConfirmingTouch(const planner::ContactMap& map, const Eigen::Vector3d& displacement,
                                                   int axis, int orientation) {
  const auto wall_from = [&](const Cell& cell) -> std::optional<Direction> {
    for (const int sign : {1, -1}) {
      if (IsBroadWall(map, cell, MakeDirection(axis, sign), orientation)) return MakeDirection(axis, sign);
    }
    return std::nullopt;
  };
  const auto path = FindFreePath(
      map, NearestFree(map, displacement, orientation),
      [&](const Cell& cell) -> std::optional<double> {
        const auto direction = wall_from(cell);
        if (!direction) return std::nullopt;
        return kTimeOfProbing * map.Travel(cell, *direction, orientation);
      },
      orientation);
  if (!path) return std::nullopt;
  const Direction direction = *wall_from(path->back());
  return ConfirmingTouch{*path, direction, map.Travel(path->back(), direction, orientation)};
}

bool FollowPath(const planner::ContactMap& map, const Eigen::Vector3d& target, const std::vector<Cell>& path,
                const std::string& kind, Mover& mover, std::vector<Touch>& evidence, FreeBy free_by) {
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Eigen::Vector3d from = mover.position();
    const Eigen::Vector3d to = target + path[i].cast<double>() + map.phase();
    const MotionReport report = mover.Fast(to, kind, {}, free_by);
    if (!report.contact) {
      Touch free;
      const auto direction = DirectionOf(to - from);
      if (!direction || (to - from).norm() < 1.0) continue;
      free.start = to;
      free.start[AxisOf(*direction)] = from[AxisOf(*direction)];
      free.direction = *direction;
      free.travelled = (to - from).norm();
      evidence.push_back(free);
      continue;
    }
    if ((report.end - from).norm() > kLeastTold) evidence.push_back(ContactAfter(from, report.end));
    const Eigen::Vector3d back = from - report.end;
    const double length = back.norm();
    mover.Retreat(length > 1.0 ? Eigen::Vector3d(report.end + back / length) : from);
    return false;
  }
  return true;
}

TargetFit Confirm(const planner::ContactMap& map, Direction insertion, int orientation, const Region& likely,
                  const Region& possible, Mover& mover, std::vector<Touch>& evidence) {
  const ExecutorOptions& options = mover.options();
  std::array<bool, 3> hopeless{};
  TargetFit fit = BestFit(map, evidence, likely, possible, orientation, options.fit);
  const int contacts_wanted = ContactsWanted(options);
  const int attempts = options.confirm_attempts + 2 * (contacts_wanted - 1);
  for (int attempt = 0; attempt < attempts; ++attempt) {
    const std::array<int, 3> contacts = ContactsOnFlatGround(map, evidence, fit, insertion, orientation, options.fit);
    const int axis = LoosestAxis(fit, contacts, insertion, hopeless, contacts_wanted);
    if (axis < 0) {
      if (fit.violations == 0) mover.TrustAgain();
      break;
    }
    const auto plan = PlanConfirmingTouch(map, mover.position() - fit.position, axis, orientation);
    if (!plan) {
      hopeless[static_cast<std::size_t>(axis)] = true;
      continue;
    }
    if (FollowPath(map, fit.position, plan->path, "transfer", mover, evidence, FreeBy::kEstimate)) {
      const double from = mover.position()[axis];
      const double slack = std::max(fit.half_width[axis], kLeastSlack);
      const double farthest = plan->travel_cells + slack + options.sure_overtravel_cells;
      const double nearest = plan->travel_cells - fit.half_width[axis];
      const MotionReport report =
          mover.Probe(plan->direction, from + SignOf(plan->direction) * farthest, "confirm",
                      std::array<double, 2>{nearest, plan->travel_cells + fit.half_width[axis]});
      Touch touch;
      touch.direction = plan->direction;
      touch.contact = report.contact;
      touch.start = report.end;
      touch.start[axis] = from;
      touch.travelled = SignOf(plan->direction) * (report.end[axis] - from);
      evidence.push_back(touch);
      const double off = std::max(mover.Cells(options.retreat_m), 0.5);
      mover.Retreat(report.end - off * UnitVector(plan->direction));
    } else {
      // Something stands where the fit says there is nothing. From farther out the next path is another one.
      mover.Retreat(mover.position() - kComeOut * UnitVector(insertion));
    }
    fit = BestFit(map, evidence, likely, possible, orientation, options.fit);
  }
  return fit;
}

}  // namespace feeler::execution
