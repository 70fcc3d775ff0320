#include "feeler/env/robot/watched_way.h"

#include <algorithm>
#include <cmath>

namespace feeler::env {

int WatchedWay::StepsLeft(double advanced_m) const {
  if (!(step_m > 0.0)) return 1;
  // Those at the wall itself were blocked: they read it.
  const auto spent = std::ranges::count_if(spent_at_m, [&](double at_m) { return at_m + step_m <= advanced_m; });
  const double left_m = length_m - advanced_m - static_cast<double>(spent) * step_m;
  return std::max(1, static_cast<int>(std::lround(left_m / step_m)));
}

WatchedWay DrawWatchedWay(const NoiseOptions& noise, double length_m, RandomStream& false_stops,
                          RandomStream& spent_steps) {
  constexpr double kNothing_m = 1e-9;
  WatchedWay way;
  way.length_m = length_m;
  way.step_m = noise.step_m;
  double made_m = length_m;  // what the steps up to the end of the motion come to
  if (noise.false_stops_per_m > 0.0) {
    const double until_false_m = -std::log(1.0 - false_stops.Uniform()) / noise.false_stops_per_m;
    way.false_contact = until_false_m < length_m;
    made_m = std::min(made_m, until_false_m);
  }
  way.advance_m = made_m;
  if (!(noise.spent_step > 0.0)) return way;
  way.advance_m = 0.0;
  // What is no whole step comes first, so that the last one, of which more may hang, is one.
  double step_m = std::fmod(made_m, noise.step_m);
  if (step_m < kNothing_m) step_m = noise.step_m;
  for (double left_m = made_m; left_m > kNothing_m; left_m -= step_m, step_m = noise.step_m) {
    if (spent_steps.Uniform() < 1.0 - std::pow(1.0 - noise.spent_step, step_m / noise.step_m)) {
      way.spent_at_m.push_back(way.advance_m);
      way.spent_m += step_m;
      way.look_m = std::min(noise.step_m, way.look_m + step_m);
    } else {
      way.advance_m += step_m;
      way.look_m = 0.0;
    }
  }
  if (way.false_contact) way.look_m = 0.0;
  return way;
}

}  // namespace feeler::env
