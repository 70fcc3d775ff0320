#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "feeler/planner/bounds/openings/open_layer.h"

// What a layer costs if its first split is at a given place: steps (O2) to (O7) of the proof in docs/planner.md.
namespace feeler::planner {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

/// (O5) A certificate is shared out over the neighbours that are members.
struct Charges {
  std::vector<double> own;       ///< per member: the sum of its shares
  std::vector<double> incoming;  ///< per member: the shares of others on it
  std::vector<double> share;     ///< 4 per member, in the order of its neighbours
  int inside = 0;                ///< members in whose opening the place lies: they are looked into before
};

void ChargeNeighbours(const OpenCertificates& certificates, const OpenLayer& layer, const Cell& place,
                      Charges& charges) {
  const std::size_t count = layer.members.size();
  charges.own.assign(count, 0.0);
  charges.incoming.assign(count, 0.0);
  charges.share.assign(4 * count, 0.0);
  charges.inside = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const OpenLayer::Member& member = layer.members[k];
    const std::size_t at = certificates.grid.Index(place - member.h);
    const double both = certificates.At(layer.orientation, member.mask, at);
    if (both < 0.0) {
      ++charges.inside;
      continue;
    }
    const double along_x = certificates.At(layer.orientation, member.mask & 3, at);
    const double along_y = certificates.At(layer.orientation, member.mask & 12, at);
    if (along_x + along_y <= 0.0) continue;
    const double charge_x = std::min(along_x, both * along_x / (along_x + along_y));
    const double charge_y = std::min(along_y, both - charge_x);
    charges.own[k] = charge_x + charge_y;
    for (std::size_t i = 0; i < 4; ++i) {
      if ((member.mask >> i & 1) == 0) continue;
      const bool alone = (member.mask >> (i ^ 1) & 1) == 0;
      const double share = (i < 2 ? charge_x : charge_y) * (alone ? 1.0 : 0.5);
      charges.incoming[static_cast<std::size_t>(member.neighbour[i])] += share;
      charges.share[4 * k + i] = share;
    }
  }
}

/// (O6) The same with mates for neighbours: a member is spared its certificate only if all its mates are looked into.
struct MateCharges {
  std::array<std::vector<double>, 2> along;  ///< per member, along x and y
  std::vector<double> own;                   ///< their sums
  double best_spared = 0.0;                  ///< by one opening at most
};

void ChargeMates(const OpenLayer& layer, const Cell& place, MateCharges& charges) {
  const std::size_t count = layer.members.size();
  for (std::vector<double>& along : charges.along) along.assign(count, 0.0);
  charges.own.assign(count, 0.0);
  std::array<double, 2> best_spared{};
  const CertificateGrid& grid = layer.mates->grid;
  for (std::size_t k = 0; k < count; ++k) {
    const OpenLayer::Member& member = layer.members[k];
    const std::size_t at = grid.Index(place - member.h);
    const double along_x = member.mates[0] > 0 ? layer.mates->planes[at] : 0.0;
    const double along_y = member.mates[1] > 0 ? layer.mates->planes[grid.cells + at] : 0.0;
    if (along_x < 0.0 || along_y < 0.0 || along_x + along_y <= 0.0) continue;
    const double both = member.mates[0] == 0   ? along_y
                        : member.mates[1] == 0 ? along_x
                                               : layer.mates->planes[2 * grid.cells + at];
    charges.along[0][k] = std::min(along_x, both * along_x / (along_x + along_y));
    charges.along[1][k] = std::min(along_y, both - charges.along[0][k]);
    charges.own[k] = charges.along[0][k] + charges.along[1][k];
    for (std::size_t axis = 0; axis < 2; ++axis) {
      if (member.mates[axis] == 0) continue;
      best_spared[axis] =
          std::max(best_spared[axis], layer.alone_by_one[axis] * charges.along[axis][k] / member.mates[axis]);
    }
  }
  charges.best_spared = best_spared[0] + best_spared[1];
}

/// (O3) What members that are not looked into cost, and what looking into one spares at most, its own cost and the
/// charges on it. Two bounds: with the way from the start to where it leaves the main path, which does not know of the
/// delay by openings looked into; and from the place on, to which the delay is added.
struct Costs {
  std::vector<double> gain_from_start, gain_from_here;  ///< by looking into a member
  double sum_from_start = 0.0, sum_from_here = 0.0;     ///< if none is looked into
  double most_from_here = 0.0;
  double best_from_start = 0.0, best_from_here = 0.0;  ///< greatest gains
};

void CountCosts(const OpenLayer& layer, double way, const std::vector<double>& charge,
                const std::vector<double>* incoming, double spared_beside, Costs& costs) {
  const std::size_t count = layer.members.size();
  costs.gain_from_start.resize(count);
  costs.gain_from_here.resize(count);
  costs.sum_from_start = costs.sum_from_here = costs.most_from_here = 0.0;
  costs.best_from_start = costs.best_from_here = 0.0;
  for (std::size_t k = 0; k < count; ++k) {
    const OpenLayer::Member& member = layer.members[k];
    double from_start = std::min(std::max(member.off_path, way), way + charge[k]);
    double from_here = std::min(member.off_rest, charge[k]);
    costs.sum_from_start += from_start;
    costs.sum_from_here += from_here;
    costs.most_from_here = std::max(costs.most_from_here, from_here);
    if (incoming != nullptr) {
      from_start += (*incoming)[k];
      from_here += (*incoming)[k];
    }
    costs.gain_from_start[k] = from_start;
    costs.gain_from_here[k] = from_here;
    costs.best_from_start = std::max(costs.best_from_start, from_start);
    costs.best_from_here = std::max(costs.best_from_here, from_here);
  }
  costs.best_from_start += spared_beside;
  costs.best_from_here += spared_beside;
}

/// Everything at a place that does not depend on how many openings are looked into. Reused per thread: places are
/// looked at some hundred thousand times a problem.
struct AtPlace {
  double way = 0.0;        ///< |r - s|
  double to_mouths = 0.0;  ///< from s to the nearest mouth
  Charges charges;
  MateCharges mate_charges;
  Costs neighbours, mates;
};

const AtPlace& LookAt(const OpenCertificates& certificates, const OpenLayer& layer, const OpenPlace& place) {
  thread_local AtPlace at;
  at.way = place.distance;
  at.to_mouths = Distance(place.place, layer.mouths);
  ChargeNeighbours(certificates, layer, place.place, at.charges);
  CountCosts(layer, at.way, at.charges.own, &at.charges.incoming, 0.0, at.neighbours);
  ChargeMates(layer, place.place, at.mate_charges);
  CountCosts(layer, at.way, at.mate_charges.own, nullptr, at.mate_charges.best_spared, at.mates);
  return at;
}

/// (O2) When m1 = m openings have been looked into before.
struct Times {
  double time = 0.0;   ///< T: everybody else gets to s then at the earliest
  double again = 0.0;  ///< and to a further opening
};

Times TimesAfter(const OpenLayer& layer, const AtPlace& at, std::size_t m) {
  const double delayed = m == 0 ? 0.0 : layer.first + layer.StepsOf(m - 1) + at.to_mouths;
  const double time = std::max(at.way, delayed);
  return {time, std::max(time + at.to_mouths, layer.first + layer.StepsOf(m))};
}

/// A place beyond the radius may be where a hypothesis leaves the main path: costs from here on count in that measure.
double WithinRadius(const OpenLayer& layer, double time, const Costs& costs) {
  return costs.most_from_here > 0.0 ? std::clamp((layer.outside - time) / costs.most_from_here, 0.0, 1.0) : 1.0;
}

/// What is saved at most by looking into up to `count` openings, `each` at a time, that save `gain` apiece when looked
/// into at time 0 and one less with every step.
double Savings(double gain, int count, int each) {
  if (gain <= 0.0 || count <= 0) return 0.0;
  const double rounds = std::min(std::ceil(gain), std::ceil(static_cast<double>(count) / each));
  return each * (rounds * gain - 0.5 * rounds * (rounds - 1.0));
}

/// What those cost that are not among the first m, if every opening spares as much as the best.
double RoughCosts(const OpenLayer& layer, const Costs& costs, const Times& times, std::size_t m) {
  const auto rest = static_cast<int>(layer.members.size() - m);
  const double from_start = costs.sum_from_start - static_cast<double>(m) * costs.best_from_start -
                            Savings(costs.best_from_start - times.again, rest, layer.each);
  const double from_here = static_cast<double>(rest) * times.time +
                           WithinRadius(layer, times.time, costs) * costs.sum_from_here -
                           static_cast<double>(m) * costs.best_from_here -
                           Savings(times.time + costs.best_from_here - times.again, rest, layer.each);
  return std::max(from_start, from_here);
}

/// (O7) Openings looked into one step apart are neighbours, and what a neighbour is spared is then counted twice: per
/// member the least that is, and what giving it back costs at most where two steps lie between looks instead.
struct CountedTwice {
  std::vector<double> least;
  double bonus = 0.0;
};

CountedTwice FindCountedTwice(const OpenLayer& layer, const Charges& charges) {
  CountedTwice twice{std::vector<double>(layer.members.size(), 0.0), 0.0};
  if (!layer.single) return twice;
  double most = 0.0;
  for (std::size_t k = 0; k < layer.members.size(); ++k) {
    const OpenLayer::Member& member = layer.members[k];
    double least = kNever;
    for (std::size_t i = 0; i < 4; ++i) {
      if ((member.mask >> i & 1) == 0) continue;
      const auto other = static_cast<std::size_t>(member.neighbour[i]);
      least = std::min(least, charges.share[4 * k + i] + charges.share[4 * other + (i ^ 1)]);
    }
    twice.least[k] = least == kNever ? 0.0 : least;
    most = std::max(most, twice.least[k]);
  }
  // Looking two steps later instead saves what is counted twice but delays all that follow.
  twice.bonus = most;
  for (int i = 1; i < most; ++i) twice.bonus += most - i;
  return twice;
}

/// For k = 0 ... n the sum of the k greatest gains, less what is counted twice.
std::vector<double> GreatestSums(std::vector<double> gains, const std::vector<double>* twice) {
  if (twice != nullptr) {
    for (std::size_t k = 0; k < gains.size(); ++k) gains[k] -= (*twice)[k];
  }
  std::ranges::sort(gains, std::greater<>());
  std::vector<double> sums = {0.0};
  for (const double gain : gains) sums.push_back(sums.back() + gain);
  return sums;
}

/// (O6) What mates are spared at most when so many openings are looked into: each stands beside at most `alone_by_one`
/// members without a mate left, and such a member needs all its mates looked into. Added to the sums.
void AddSparedMates(const OpenLayer& layer, const MateCharges& charges, std::vector<double>& from_start,
                    std::vector<double>& from_here) {
  const std::size_t count = layer.members.size();
  for (std::size_t axis = 0; axis < 2; ++axis) {
    std::vector<std::pair<double, double>> items;  // what is spared per mate, mates
    for (std::size_t k = 0; k < count; ++k) {
      const double mates = layer.members[k].mates[axis];
      if (mates > 0.0) items.emplace_back(charges.along[axis][k] / mates, mates);
    }
    std::ranges::sort(items, std::greater<>());
    std::size_t item = 0;
    double used = 0.0;
    double spared = 0.0;
    for (std::size_t looks = 1; looks <= count; ++looks) {
      double room = layer.alone_by_one[axis];
      while (room > 0.0 && item < items.size()) {
        const double take = std::min(room, items[item].second - used);
        spared += take * items[item].first;
        used += take;
        room -= take;
        if (used >= items[item].second) {
          used = 0.0;
          ++item;
        }
      }
      from_start[looks] += spared;
      from_here[looks] += spared;
    }
  }
}

/// One valid way to count the costs, by rank of what looks spare; the best of all ways is the bound.
struct Account {
  const Costs& costs;
  /// Of the k greatest gains, from the start and from here on.
  std::vector<double> spared_from_start, spared_from_here;
  /// Given back in `spared`: then looks are taken one step after another, and the bonus covers what that misses.
  double bonus = 0.0;
  bool step_by_step = false;
};

std::array<Account, 3> AccountsOf(const OpenLayer& layer, const AtPlace& at) {
  const CountedTwice twice = FindCountedTwice(layer, at.charges);
  const Costs& n = at.neighbours;
  std::array<Account, 3> accounts = {
      Account{n, GreatestSums(n.gain_from_start, nullptr), GreatestSums(n.gain_from_here, nullptr), 0.0, false},
      Account{n, GreatestSums(n.gain_from_start, &twice.least), GreatestSums(n.gain_from_here, &twice.least),
              twice.bonus, true},
      Account{at.mates, GreatestSums(at.mates.gain_from_start, nullptr), GreatestSums(at.mates.gain_from_here, nullptr),
              0.0, false}};
  AddSparedMates(layer, at.mate_charges, accounts[2].spared_from_start, accounts[2].spared_from_here);
  return accounts;
}

}  // namespace

double RoughBound(const OpenCertificates& certificates, const OpenLayer& layer, const OpenPlace& place) {
  const AtPlace& at = LookAt(certificates, layer, place);
  const std::size_t count = layer.members.size();
  double bound = kNever;
  for (auto m = static_cast<std::size_t>(at.charges.inside); m < count; ++m) {
    const Times times = TimesAfter(layer, at, m);
    const double early = layer.slots_before[m];
    const double rest = std::max({RoughCosts(layer, at.neighbours, times, m), RoughCosts(layer, at.mates, times, m),
                                  static_cast<double>(count - m) * times.time});
    bound = std::min(bound, early + rest);
    if (early > bound) break;
  }
  return std::max(place.bound, bound);
}

double RefinedBound(const OpenCertificates& certificates, const OpenLayer& layer, const OpenPlace& place) {
  const AtPlace& at = LookAt(certificates, layer, place);
  const std::array<Account, 3> accounts = AccountsOf(layer, at);
  const std::size_t count = layer.members.size();
  double bound = kNever;
  for (auto m = static_cast<std::size_t>(at.charges.inside); m < count; ++m) {
    const double early = layer.slots_before[m];
    const double early_step_by_step =
        static_cast<double>(m) * layer.first + 0.5 * static_cast<double>(m * (m - (m > 0)));
    if (early_step_by_step > bound) break;
    const Times times = TimesAfter(layer, at, m);
    // By the number of openings that are looked into in all.
    double late = 0.0;
    for (std::size_t looks = m; looks < count; ++looks) {
      if (looks > m) late += times.again + layer.StepsOf(looks - 1 - m);
      const double least_rest = static_cast<double>(count - looks) * times.time;
      double best = early + least_rest;
      for (const Account& account : accounts) {
        const double back = account.step_by_step ? (m == 0 ? 1.0 : 2.0) * account.bonus : 0.0;
        const double before = account.step_by_step ? early_step_by_step : early;
        const double from_start = -account.spared_from_start[looks] - back + account.costs.sum_from_start;
        const double from_here =
            -account.spared_from_here[looks] - back +
            (least_rest + WithinRadius(layer, times.time, account.costs) * account.costs.sum_from_here);
        best = std::max({best, before + from_start, before + from_here});
      }
      bound = std::min(bound, best + late);
    }
  }
  return std::max(place.bound, bound);
}

}  // namespace feeler::planner
