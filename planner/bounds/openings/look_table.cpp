#include "feeler/planner/bounds/openings/look_table.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <unordered_map>
#include <utility>

#include "feeler/core/lattice_grid.h"
#include "feeler/core/worker_pool.h"
#include "feeler/planner/bounds/cuboids/box_partition.h"
#include "feeler/planner/contact/active_region.h"

namespace feeler::planner {
namespace {

/// Costs of a cell by the number of hypotheses that are gone: convex and falling where they are not being made.
using Costs = std::vector<double>;

/// Stands for what cannot be told apart: a bound as well as any.
constexpr double kMost = 1e9;
/// What is kept: whole multiples of a unit, which is a step's cost over this or a power of two more.
constexpr int kGreatest = std::numeric_limits<std::uint16_t>::max();
constexpr double kFinest = 64.0;
constexpr double kRounding = 1e-9;
constexpr std::array<AxisOrder, 2> kOrders = {{{0, 1, 2}, {1, 0, 2}}};

/// The greatest convex function below.
void TakeConvexHull(Costs& costs) {
  thread_local std::vector<std::size_t> hull;
  hull.clear();
  for (std::size_t k = 0; k < costs.size(); ++k) {
    const auto above = [&](std::size_t before, std::size_t middle) {
      return (costs[middle] - costs[before]) * static_cast<double>(k - before) >=
             (costs[k] - costs[before]) * static_cast<double>(middle - before);
    };
    while (hull.size() >= 2 && above(hull[hull.size() - 2], hull.back())) hull.pop_back();
    hull.push_back(k);
  }
  for (std::size_t i = 0; i + 1 < hull.size(); ++i) {
    const std::size_t first = hull[i];
    const std::size_t last = hull[i + 1];
    if (last == first + 1) continue;
    const double step = (costs[last] - costs[first]) / static_cast<double>(last - first);
    for (std::size_t k = first + 1; k < last; ++k) costs[k] = costs[first] + step * static_cast<double>(k - first);
  }
}

/// out[k] = least of a[i] + b[k - i], of two convex functions: their steps, steepest first.
void AddUp(const Costs& a, const Costs& b, Costs& out) {
  out.clear();
  std::size_t i = 0;
  std::size_t j = 0;
  out.push_back(a[0] + b[0]);
  while (i + 1 < a.size() || j + 1 < b.size()) {
    const double of_a = i + 1 < a.size() ? a[i + 1] - a[i] : 0.0;
    const double of_b = j + 1 < b.size() ? b[j + 1] - b[j] : 0.0;
    const bool take_a = j + 1 == b.size() || (i + 1 < a.size() && of_a <= of_b);
    out.push_back(std::max(0.0, out.back() + (take_a ? of_a : of_b)));
    ++(take_a ? i : j);
  }
}

/// Boxes of a set, as each order of axes cuts it.
std::vector<std::vector<HypothesisBox>> PartitionsOf(const Bits256& set) {
  std::vector<std::vector<HypothesisBox>> partitions;
  for (const AxisOrder& order : kOrders) {
    std::vector<Bits256> layers = {set};
    std::vector<HypothesisBox> boxes;
    PartitionIntoBoxes(layers, order, Cell(LookTable::kLongest, LookTable::kLongest, 1), boxes);
    if (partitions.empty() || boxes != partitions.front()) partitions.push_back(std::move(boxes));
  }
  return partitions;
}

}  // namespace

/// Fills the plane of one rectangle; smaller ones are done.
class LookTable::Filler {
 public:
  Filler(LookTable& table, const Source& source) : table_(table), source_(source) {}

  void Fill(const Cell& size) {
    plane_ = &table_.planes_[table_.PlaneIndex(size)];
    size_ = size;
    count_ = size.x() * size.y();
    window_ = Rectangle(0, 0, size.x(), size.y());
    splits_.clear();
    Prepare();
    for (int gone = plane_->most - 1; gone >= 0; --gone) {
      if (Motions()) {
        FillByMotions(gone);
      } else {
        FillBySteps(gone);
      }
    }
    Write();
  }

 private:
  /// What a step tells apart depends on its mask alone.
  struct Split {
    int hits = 0;
    std::vector<std::vector<HypothesisBox>> hit, missed;
  };
  /// What each who is left pays for a step; and what of the costs of those told apart by it has been paid already.
  struct Payment {
    double step = 0.0;
    double before = 0.0;
  };
  static constexpr std::uint8_t kInside = 1U << kDirectionCount;
  static constexpr std::uint32_t kNowhere = std::numeric_limits<std::uint32_t>::max();

  /// Setting out costs something: it matters which way the tool is moving.
  bool Motions() const { return table_.costs_.start > 0.0; }
  double StepCost(Direction d) const {
    return table_.costs_.free + table_.costs_.beyond[static_cast<std::size_t>(AxisOf(d))];
  }
  /// Where splits by a step in direction d are kept: one array serves for all unless there are motions.
  std::vector<double>& AfterSplit(Direction d) {
    return after_split_[Motions() ? static_cast<std::size_t>(IndexOf(d)) : 0];
  }

  /// Entries of a cell by the number gone, as they are being made.
  double& Value(std::vector<double>& of, int gone, std::size_t cell) const {
    return of[static_cast<std::size_t>(gone) * plane_->Cells() + cell];
  }

  /// Everything that one step or one look does: silent steps, splits, openings.
  void Prepare() {
    const std::size_t cells = plane_->Cells();
    const auto rows = static_cast<std::size_t>(plane_->most);
    silent_.assign(cells, 0);
    looks_.assign(cells, 0);
    look_cost_.assign(cells, 0.0);
    look_directions_.assign(cells, 0);
    for (std::vector<std::uint32_t>& across : across_) across.assign(cells, kNowhere);
    for (const Direction d : kDirections) AfterSplit(d).assign(rows * cells, kMost);
    moved_.assign(rows * cells, kMost);
    best_.assign(rows * cells, kMost);
    std::size_t at = 0;
    ForEachCell({Cell::Zero(), plane_->stored - Cell::Ones()}, [&](const Cell& cell) {
      const std::size_t here = at++;
      const Cell displacement = table_.grid_.active.min + cell;
      const Bits256 inside = Inside(displacement);
      if (inside.Any()) {
        PrepareInside(here, displacement, inside);
      } else {
        PrepareOutside(here, cell, displacement);
      }
    });
  }

  Bits256 Inside(const Cell& displacement) const {
    Bits256 inside;
    if (!table_.MayBeInside(displacement)) return inside;
    for (int y = 0; y < size_.y(); ++y) {
      for (int x = 0; x < size_.x(); ++x) {
        if (source_.filled.Blocked(displacement - Cell(x, y, 0))) inside.Set(x + kLongest * y);
      }
    }
    return inside;
  }

  /// Those inside are gone already; steps count from outside only.
  void PrepareInside(std::size_t here, const Cell& displacement, const Bits256& inside) {
    silent_[here] = kInside;
    const int gone = inside.Count();
    Costs left;
    BestPartition(PartitionsOf(window_.Without(inside)), displacement, {}, left);
    for (int k = 0; k < plane_->most; ++k) {
      const auto more = static_cast<std::size_t>(std::max(0, k - gone));
      Value(best_, k, here) = more < left.size() ? left[more] : 0.0;
    }
  }

  void PrepareOutside(std::size_t here, const Cell& cell, const Cell& displacement) {
    bool all_stop = true;
    for (const Direction d : kDirections) {
      const int next = cell[AxisOf(d)] + SignOf(d);
      const std::uint32_t mask = source_.masks.Index(displacement, d, 0);
      const Split& split = SplitOf(mask);
      if (split.hits == 0) {
        // A step out of what is stored changes nothing: outside all repeats, or is the mirror image of the inside,
        // which matters to who is moving.
        if (next >= 0 && next < plane_->stored[AxisOf(d)]) {
          silent_[here] |= static_cast<std::uint8_t>(1U << IndexOf(d));
        } else if (next >= 0 && next < plane_->whole[AxisOf(d)]) {
          Cell image = cell;
          image[AxisOf(d)] = plane_->whole[AxisOf(d)] - 1 - next;
          across_[static_cast<std::size_t>(AxisOf(d))][here] =
              static_cast<std::uint32_t>(GridIndex(plane_->stored, image));
        }
      } else if (split.hits < count_) {
        const bool stays = next < 0 || next >= plane_->whole[AxisOf(d)];
        // Whom the step goes on under is still moving: setting out again is not to be paid.
        BestPartition(split.hit, displacement, {table_.costs_.contact, 0.0}, hit_);
        BestPartition(split.missed, stays ? displacement : Cell(displacement + UnitCell(d)),
                      {StepCost(d), table_.costs_.start}, missed_);
        AddUp(hit_, missed_, both_);
        for (int k = 0; k < plane_->most; ++k) {
          double& value = Value(AfterSplit(d), k, here);
          value =
              std::min(value, static_cast<std::size_t>(k) < both_.size() ? both_[static_cast<std::size_t>(k)] : 0.0);
        }
      }
    }
    for (std::size_t i = 0; i < source_.openings.mouths.size(); ++i) {
      const Cell of = displacement - source_.openings.mouths[i];
      if (of.z() != 0 || (of.array() < 0).any() || of.x() >= size_.x() || of.y() >= size_.y()) continue;
      ++looks_[here];
      // A look that is a split, too, is paid for there.
      const Direction d = source_.openings.directions[i];
      look_directions_[here] |= static_cast<std::uint8_t>(1U << IndexOf(d));
      all_stop = all_stop && SplitOf(source_.masks.Index(displacement, d, 0)).hits == count_;
    }
    look_cost_[here] = all_stop ? table_.costs_.contact : 0.0;
  }

  const Split& SplitOf(std::uint32_t mask) {
    const auto [at, added] = splits_.try_emplace(mask);
    Split& split = at->second;
    if (!added) return split;
    const Bits256 hit = source_.masks.Mask(mask) & window_;
    split.hits = hit.Count();
    if (split.hits == 0 || split.hits == count_) return split;
    split.hit = PartitionsOf(hit);
    split.missed = PartitionsOf(window_.Without(hit));
    return split;
  }

  /// The best bound of a set after a step, by the number gone of it, over its partitions.
  void BestPartition(const std::vector<std::vector<HypothesisBox>>& partitions, const Cell& displacement,
                     const Payment& payment, Costs& best) {
    best.clear();
    for (const std::vector<HypothesisBox>& boxes : partitions) {
      sum_.assign(1, 0.0);
      for (const HypothesisBox& box : boxes) {
        OfBox(box, displacement, payment, one_);
        AddUp(sum_, one_, added_);
        sum_.swap(added_);
      }
      if (best.size() < sum_.size()) best.resize(sum_.size(), 0.0);
      for (std::size_t k = 0; k < sum_.size(); ++k) best[k] = std::max(best[k], sum_[k]);
    }
  }

  void OfBox(const HypothesisBox& box, const Cell& displacement, const Payment& payment, Costs& costs) const {
    const Plane& plane = table_.planes_[table_.PlaneIndex(box.size)];
    const int count = box.size.x() * box.size.y();
    costs.assign(static_cast<std::size_t>(std::min(count, kMostLooks)) + 1, 0.0);
    for (int k = 0; k < std::min(count, kMostLooks); ++k) {
      costs[static_cast<std::size_t>(k)] = (count - k) * payment.step;
    }
    if (plane.most > 0) {
      const BoxGrid::Place place = table_.grid_.PlaceOf(plane, displacement - box.low);
      for (int k = 0; k < plane.most; ++k) {
        const auto i = static_cast<std::size_t>(k);
        const double rest = plane.values[place.index * static_cast<std::size_t>(plane.most) + i] * plane.unit +
                            place.beyond * (count - k) * table_.costs_.free;
        costs[i] += std::max(0.0, rest - (count - k) * payment.before);
      }
    }
    TakeConvexHull(costs);
  }

  /// A look from here, when so many are gone.
  double AfterLook(int gone, std::size_t cell) {
    const int then = gone + looks_[cell];
    const double after = then < plane_->most ? Value(moved_, then, cell) : 0.0;
    return after + std::max(0, count_ - then) * look_cost_[cell];
  }

  /// Steps that show nothing, until nothing changes; then the entries with so many gone are known.
  void FillBySteps(int gone) {
    const std::size_t cells = plane_->Cells();
    const double step = (count_ - gone) * table_.costs_.free;
    double* const moved = &Value(moved_, gone, 0);
    double* const best = &Value(best_, gone, 0);
    for (std::size_t i = 0; i < cells; ++i) {
      if (silent_[i] == kInside) continue;
      moved[i] = best[i] = Value(after_split_[0], gone, i);
      if (looks_[i] > 0) best[i] = std::min(best[i], AfterLook(gone, i));
    }
    const auto strides = GridStrides(plane_->stored);
    const auto relax = [&](std::size_t here) {
      if (silent_[here] == kInside) return false;
      double least = moved[here];
      for (const Direction d : kDirections) {
        if ((silent_[here] >> IndexOf(d) & 1) == 0) continue;
        const auto there = static_cast<std::size_t>(static_cast<std::int64_t>(here) +
                                                    SignOf(d) * strides[static_cast<std::size_t>(AxisOf(d))]);
        least = std::min(least, best[there] + step);
      }
      if (least >= moved[here]) return false;
      moved[here] = least;
      best[here] = std::min(best[here], least);
      return true;
    };
    for (bool changed = true; changed;) {
      changed = false;
      for (std::size_t i = 0; i < cells; ++i) changed = relax(i) || changed;
      if (!changed) break;
      changed = false;
      for (std::size_t i = cells; i-- > 0;) changed = relax(i) || changed;
    }
  }

  /// The same where setting out costs something: a motion goes straight on and ends at will, by a contact or by a look.
  void FillByMotions(int gone) {
    const double start = (count_ - gone) * table_.costs_.start;
    double* const moved = &Value(moved_, gone, 0);
    double* const best = &Value(best_, gone, 0);
    for (std::vector<double>& moving : moving_) moving.assign(plane_->Cells(), kMost);
    for (bool changed = true; changed;) {
      for (const Direction d : kDirections) MoveOn(d, gone);
      changed = false;
      for (std::size_t i = 0; i < plane_->Cells(); ++i) {
        if (silent_[i] == kInside) continue;
        double least = kMost;
        for (const Direction d : kDirections)
          least = std::min(least, start + unlooked_[static_cast<std::size_t>(IndexOf(d))][i]);
        if (least < moved[i]) {
          moved[i] = least;
          changed = true;
        }
        best[i] = std::min(best[i], moved[i]);
        if (looks_[i] > 0) best[i] = std::min(best[i], start + AfterLook(gone, i));
      }
    }
  }

  /// Motions in one direction from every cell, given what stopping costs: with a look or a stop first, and without.
  void MoveOn(Direction d, int gone) {
    const std::size_t cells = plane_->Cells();
    const double step = (count_ - gone) * StepCost(d);
    const double* const best = &Value(best_, gone, 0);
    const double* const split = &Value(AfterSplit(d), gone, 0);
    std::vector<double>& moving = moving_[static_cast<std::size_t>(IndexOf(d))];
    std::vector<double>& unlooked = unlooked_[static_cast<std::size_t>(IndexOf(d))];
    const std::vector<double>& back = moving_[static_cast<std::size_t>(IndexOf(Opposite(d)))];
    const std::vector<std::uint32_t>& across = across_[static_cast<std::size_t>(AxisOf(d))];
    unlooked.resize(cells);
    const auto unit = static_cast<std::uint8_t>(1U << IndexOf(d));
    const std::int64_t stride = SignOf(d) * GridStrides(plane_->stored)[static_cast<std::size_t>(AxisOf(d))];
    for (std::size_t k = 0; k < cells; ++k) {
      const std::size_t i = SignOf(d) > 0 ? cells - 1 - k : k;
      if (silent_[i] == kInside) continue;
      double least = split[i];
      if ((silent_[i] & unit) != 0) {
        least = std::min(least, step + moving[static_cast<std::size_t>(static_cast<std::int64_t>(i) + stride)]);
      } else if (SignOf(d) > 0 && across[i] != kNowhere) {
        least = std::min(least, step + back[across[i]]);
      }
      unlooked[i] = least;
      least = std::min(least, best[i]);
      if ((look_directions_[i] & unit) != 0) least = std::min(least, AfterLook(gone, i));
      moving[i] = least;
    }
  }

  void Write() {
    const std::size_t cells = plane_->Cells();
    double greatest = 0.0;
    for (const double value : best_) greatest = std::max(greatest, value < kMost ? value : 0.0);
    plane_->unit = (table_.costs_.free > 0.0 ? table_.costs_.free : 1.0) / kFinest;
    while (plane_->unit * kGreatest < greatest) plane_->unit *= 2.0;
    const auto most = static_cast<std::size_t>(plane_->most);
    std::vector<std::uint16_t> values(cells * most);
    Costs costs(most + 1);
    for (std::size_t i = 0; i < cells; ++i) {
      for (std::size_t k = 0; k < most; ++k) costs[k] = best_[k * cells + i];
      costs[most] = 0.0;
      TakeConvexHull(costs);
      for (std::size_t k = 0; k < most; ++k) {
        const double units = std::floor(costs[k] / plane_->unit + kRounding);
        values[i * most + k] = static_cast<std::uint16_t>(std::clamp<double>(units, 0.0, kGreatest));
      }
    }
    plane_->values = std::move(values);
  }

  LookTable& table_;
  const Source& source_;
  Plane* plane_ = nullptr;
  Cell size_ = Cell::Zero();
  int count_ = 0;
  Bits256 window_;
  std::unordered_map<std::uint32_t, Split> splits_;
  std::vector<std::uint8_t> silent_;  ///< per cell: bit d if step d is free whoever is right; or kInside
  /// Per axis and cell: where a step across the middle of a mirrored axis leads, as its mirror image.
  std::array<std::vector<std::uint32_t>, 3> across_;
  std::vector<int> looks_;                     ///< per cell: openings that can be looked into from here, at most
  std::vector<double> look_cost_;              ///< of a look, to each who is left
  std::vector<std::uint8_t> look_directions_;  ///< per cell: bit d if an opening is looked into by a step d
  /// By the number gone and the cell: once a split is next; once a step has to come before the next look; at best.
  std::array<std::vector<double>, kDirectionCount> after_split_;
  std::vector<double> moved_, best_;
  /// By the direction and the cell, while moving: at best; and if this cell's openings have been looked into.
  std::array<std::vector<double>, kDirectionCount> moving_, unlooked_;
  Costs hit_, missed_, both_, sum_, added_, one_;
};

LookTable::LookTable(const Source& source, const StepCosts& costs, const Cell& spread, const Cell& largest,
                     Parallelism jobs, const ProgressCallback& progress, const CancellationToken* cancellation,
                     const ArrayStore* store)
    : grid_(ActiveRegion(source.filled)),
      spread_(spread),
      largest_(largest.cwiseMin(Cell(kLongest, kLongest, 1))),
      costs_(costs) {
  grid_.mirrored[2] = false;  // what lies below the mouths never does above
  highest_ = grid_.active.min.z();
  ForEachCell(source.filled.domain(), [&](const Cell& cell) {
    if (source.filled.Blocked(cell)) highest_ = std::max(highest_, cell.z());
  });
  const std::vector<Cell>& mouths = source.openings.mouths;
  for (const Cell& mouth : mouths) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      Cell image = mouth;
      const auto i = static_cast<Eigen::Index>(axis);
      image[i] = grid_.active.min[i] + grid_.active.max[i] - mouth[i];
      grid_.mirrored[axis] = grid_.mirrored[axis] && std::ranges::find(mouths, image) != mouths.end();
    }
  }
  FitIntoMemory();
  std::vector<SharedArray<std::uint16_t>*> values;
  std::vector<double> units;
  for (Plane& plane : planes_) values.push_back(&plane.values);
  SharedArray<double> kept_units;
  if (store != nullptr && store->Take("look-units", std::vector{&kept_units}) && kept_units.size() == planes_.size() &&
      store->Take("looks", values)) {
    for (std::size_t i = 0; i < planes_.size(); ++i) planes_[i].unit = kept_units[i];
    return;
  }
  if (!FillAll(source, jobs, progress, cancellation) || store == nullptr) return;
  for (const Plane& plane : planes_) units.push_back(plane.unit);
  kept_units = std::move(units);
  store->Keep("look-units", std::vector{&kept_units});
  store->Keep("looks", values);
}

LookTable::Plane LookTable::PlaneOf(const Cell& size) const {
  Plane plane{grid_.ShapeOf(size), 0, 1.0, {}};
  const int left = size.x() - 1 <= spread_.x() && size.y() - 1 <= spread_.y()
                       ? size.x() * size.y()
                       : (spread_.x() + 1) * (spread_.y() + 1);  // what a goal may leave
  plane.most = std::clamp(size.x() * size.y() - left, 0, kMostLooks);
  return plane;
}

void LookTable::FitIntoMemory() {
  while (true) {
    planes_.clear();
    std::size_t bytes = 0;
    ForEachCell({Cell::Ones(), largest_}, [&](const Cell& size) {
      const Plane& plane = planes_.emplace_back(PlaneOf(size));
      bytes += plane.Cells() * static_cast<std::size_t>(plane.most) * sizeof(std::uint16_t);
    });
    if (bytes <= kMostBytes || largest_.maxCoeff() <= 1) return;
    largest_ = largest_.cwiseMin(largest_.maxCoeff() - 1);
  }
}

bool LookTable::FillAll(const Source& source, Parallelism jobs, const ProgressCallback& progress,
                        const CancellationToken* cancellation) {
  const auto work = [&](const Cell& size) {
    const Plane& plane = planes_[PlaneIndex(size)];
    return static_cast<std::int64_t>(plane.Cells()) * plane.most;
  };
  std::int64_t total = 0;
  ForEachCell({Cell::Ones(), largest_}, [&](const Cell& size) { total += work(size); });
  std::int64_t done = 0;
  std::mutex mutex;
  // A rectangle is cut into smaller ones: their extents have a smaller sum. Those of equal sum are independent.
  for (int sum = 3; sum <= largest_.x() + largest_.y(); ++sum) {
    std::vector<Cell> level;
    ForEachCell({Cell::Ones(), largest_}, [&](const Cell& size) {
      if (size.x() + size.y() == sum && work(size) > 0) level.push_back(size);
    });
    RunWorkers(
        level.size(), jobs,
        [&] {
          return [&, filler = Filler(*this, source)](std::size_t i) mutable {
            filler.Fill(level[i]);
            if (!progress) return;
            const std::lock_guard lock(mutex);
            done += work(level[i]);
            progress(100 * done / total, 100);
          };
        },
        cancellation);
    if (cancellation != nullptr && cancellation->cancelled()) return false;
  }
  return true;
}

double LookTable::At(const Cell& displacement, const Cell& size, int gone) const {
  const Plane& plane = planes_[PlaneIndex(size)];
  if (gone >= plane.most) return 0.0;
  const BoxGrid::Place place = grid_.PlaceOf(plane, displacement);
  const std::size_t i = place.index * static_cast<std::size_t>(plane.most) + static_cast<std::size_t>(gone);
  return plane.values[i] * plane.unit + place.beyond * (size.x() * size.y() - gone) * costs_.free;
}

std::size_t LookTable::bytes() const {
  std::size_t bytes = 0;
  for (const Plane& plane : planes_) bytes += plane.values.bytes();
  return bytes;
}

}  // namespace feeler::planner
