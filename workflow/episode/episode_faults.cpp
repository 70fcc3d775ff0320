#include "feeler/workflow/episode/episode_faults.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "feeler/core/error.h"

namespace feeler::workflow {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

/// What a name adds to the world; the arm's presets stand in env.
struct WorldNoise {
  const char* name;
  const char* meaning;
  void (*add)(EpisodeFaults& noise);
};

void AddYaw(EpisodeFaults& noise, double least_degrees, double most_degrees) {
  if (noise.yaw_error_rad > 0.0) throw InputError("noise", "two yaw errors", "give one of them");
  noise.yaw_error_rad = most_degrees * kDegree;
  noise.yaw_error_least_rad = least_degrees * kDegree;
}

void AddOutside(EpisodeFaults& noise, double least_mm, double most_mm) {
  if (noise.outside) throw InputError("noise", "two distances outside the box", "give one of them");
  noise.outside = true;
  noise.outside_least_m = 1e-3 * least_mm;
  noise.outside_most_m = 1e-3 * most_mm;
}

void SetOnce(std::optional<FaultRange>& range, const char* what, double least, double most) {
  if (range) throw InputError("noise", std::string("two ranges of ") + what, "give one of them");
  range = FaultRange{least, most};
}

void AddForceNoise(EpisodeFaults& n, double least_n, double most_n) {
  SetOnce(n.force_noise_n, "force noise", least_n, most_n);
  n.robot.force_noise_n = most_n;
  n.robot.contact_threshold_n = std::max(n.robot.contact_threshold_n, 4.0 + 6.0 * most_n);
}
void AddLatency(EpisodeFaults& n, double least_ms, double most_ms) {
  SetOnce(n.latency_s, "latency", 1e-3 * least_ms, 1e-3 * most_ms);
  n.robot.force_delay_s = 1e-3 * most_ms;
}
void AddContactFriction(EpisodeFaults& n, double least, double most) {
  SetOnce(n.contact_friction, "contact friction", least, most);
}
void AddSlip(EpisodeFaults& n, double least_mm, double most_mm) {
  SetOnce(n.slip_m, "slip", 1e-3 * least_mm, 1e-3 * most_mm);
}

void AddPortStiffness(EpisodeFaults& n, double least_n_mm, double most_n_mm) {
  SetOnce(n.port_stiffness_n_m, "port stiffness", 1e3 * least_n_mm, 1e3 * most_n_mm);
}

void AddWorn(EpisodeFaults& n, double least_mm, double most_mm) {
  SetOnce(n.worn_m, "wear", 1e-3 * least_mm, 1e-3 * most_mm);
}

constexpr WorldNoise kWorldNoises[] = {
    {"outside", "the target stands 0.5 to 4 mm outside the box of hypotheses on one axis",
     [](EpisodeFaults& n) { AddOutside(n, 0.5, 4.0); }},
    {"fall-in", "the target stands where a probe of the policy falls into the opening",
     [](EpisodeFaults& n) { n.fall_in = true; }},
    {"oversize", "the sides of the target stand 0.5 mm farther out than in the model",
     [](EpisodeFaults& n) { n.oversize_m = 0.0005; }},
    {"yaw-1", "the target is turned by 1 degree, either way", [](EpisodeFaults& n) { AddYaw(n, 1.0, 1.0); }},
    {"yaw-2", "the target is turned by 2 degrees", [](EpisodeFaults& n) { AddYaw(n, 2.0, 2.0); }},
    {"yaw-3", "the target is turned by 3 degrees", [](EpisodeFaults& n) { AddYaw(n, 3.0, 3.0); }},
};

/// Names with a number, "force-noise=2".
struct MeasuredNoise {
  const char* name;
  const char* meaning;
  double least;
  double most;
  void (*add)(EpisodeFaults& noise, double value);
};

constexpr MeasuredNoise kMeasuredNoises[] = {
    {"force-noise", "noise of the force sensor, N; contacts are told from 4 N + 6 times that on", 0.0, 50.0,
     [](EpisodeFaults& n, double newton) { AddForceNoise(n, newton, newton); }},
    {"joint-friction", "friction of the large joints, Nm; the wrists have two fifths of it", 0.0, 30.0,
     [](EpisodeFaults& n, double torque_nm) {
       for (int i = 0; i < env::kJointCount; ++i) n.robot.joint_friction_nm[i] = (i < 3 ? 1.0 : 0.4) * torque_nm;
       // Friction that the observer has not caught up with reads as force at the tool.
       if (torque_nm > 0.0) n.robot.contact_threshold_n = std::max(n.robot.contact_threshold_n, 10.0);
     }},
    {"stiffness", "stiffness of each joint between encoder and link, Nm/rad (a UR10e has some 50000)", 1e4, 1e9,
     [](EpisodeFaults& n, double stiffness) { n.robot.joint_stiffness_nm_rad = stiffness; }},
    {"yaw", "the target is turned by so many degrees, either way", 0.0, 30.0,
     [](EpisodeFaults& n, double degrees) { AddYaw(n, degrees, degrees); }},
    {"outside", "the target stands so many mm outside the box of hypotheses on one axis", 0.0, 100.0,
     [](EpisodeFaults& n, double mm) { AddOutside(n, mm, mm); }},
    {"latency", "forces are told so many ms late", 0.0, 50.0,
     [](EpisodeFaults& n, double ms) { AddLatency(n, ms, ms); }},
    {"contact-friction", "coefficient of friction of every contact", 0.0, 5.0,
     [](EpisodeFaults& n, double friction) { AddContactFriction(n, friction, friction); }},
    {"slip", "the tool has slipped in the gripper by so many mm across the insertion, and turned by 2 degrees a mm",
     0.0, 5.0, [](EpisodeFaults& n, double mm) { AddSlip(n, mm, mm); }},
    {"false-stop", "probability, a cell, that a motion watched for contact ends with a contact that is none", 0.0, 0.5,
     [](EpisodeFaults& n, double probability) { n.false_stop = probability; }},
    {"missed-contact", "probability, a cell of a motion that a wall stops, that it is not reported; the cell is spent",
     0.0, 0.5, [](EpisodeFaults& n, double probability) { n.missed_contact = probability; }},
    {"spent-step", "probability, a cell of a motion watched for contact, that it is spent while the tool stays", 0.0,
     0.5, [](EpisodeFaults& n, double probability) { n.spent_step = probability; }},
    {"port-stiffness", "the target stands on springs of so many N/mm, gives way by up to 1 mm and may stay displaced",
     0.1, 1e4, [](EpisodeFaults& n, double n_mm) { AddPortStiffness(n, n_mm, n_mm); }},
    {"worn", "the lead-in of the target is larger by so many mm (negative: smaller)", -5.0, 5.0,
     [](EpisodeFaults& n, double mm) { AddWorn(n, mm, mm); }},
};

/// Names with a range, "yaw=0..5": the value is drawn uniformly per episode.
struct DrawnNoise {
  const char* name;
  double least;
  double most;
  void (*add)(EpisodeFaults& noise, double from, double to);
};

constexpr DrawnNoise kDrawnNoises[] = {{"yaw", 0.0, 30.0, AddYaw},
                                       {"outside", 0.0, 100.0, AddOutside},
                                       {"force-noise", 0.0, 50.0, AddForceNoise},
                                       {"latency", 0.0, 50.0, AddLatency},
                                       {"contact-friction", 0.0, 5.0, AddContactFriction},
                                       {"slip", 0.0, 5.0, AddSlip},
                                       {"port-stiffness", 0.1, 1e4, AddPortStiffness},
                                       {"worn", -5.0, 5.0, AddWorn}};

bool ReadNumber(const std::string& text, double& value) {
  std::istringstream number(text);
  return static_cast<bool>(number >> value) && number.eof();
}

/// Takes "NAME=FROM..TO" with a name of kDrawnNoises; false for any other text.
bool AddDrawn(const std::string& text, EpisodeFaults& noise) {
  const std::size_t equals = text.find('=');
  const std::size_t dots = text.find("..");
  if (equals == std::string::npos || dots == std::string::npos || dots < equals) return false;
  const std::string name = text.substr(0, equals);
  for (const DrawnNoise& drawn : kDrawnNoises) {
    if (name != drawn.name) continue;
    double from = 0.0;
    double to = 0.0;
    if (!ReadNumber(text.substr(equals + 1, dots - equals - 1), from) || !ReadNumber(text.substr(dots + 2), to) ||
        !(from >= drawn.least && from <= to && to <= drawn.most)) {
      throw InputError("noise", "'" + text + "' has no sensible range",
                       fmt::format("give {}=FROM..TO within {} to {}", name, drawn.least, drawn.most));
    }
    drawn.add(noise, from, to);
    return true;
  }
  throw InputError(
      "noise", "'" + text + "': " + name + " takes no range",
      "yaw, outside, force-noise, latency, contact-friction, slip, port-stiffness and worn take one, FROM..TO; "
      "give a number");
}

/// Takes "NAME=NUMBER" with a name of kMeasuredNoises; false for any other text.
bool AddMeasured(const std::string& text, EpisodeFaults& noise) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) return false;
  const std::string name = text.substr(0, equals);
  for (const MeasuredNoise& measured : kMeasuredNoises) {
    if (name != measured.name) continue;
    double value = 0.0;
    if (!ReadNumber(text.substr(equals + 1), value) || !(value >= measured.least && value <= measured.most)) {
      throw InputError("noise", "'" + text + "' has no sensible number",
                       fmt::format("give {}=NUMBER of {} to {}", name, measured.least, measured.most));
    }
    measured.add(noise, value);
    return true;
  }
  return false;
}

const char* MeaningOfArmNoise(const std::string& name) {
  if (name == "ideal") return "nothing";
  if (name == "friction") return "3 Nm of friction in the large joints, 1.2 Nm in the wrists, force noise of 1 N";
  return "arm and force sensor";
}

std::vector<std::string> Split(std::string_view text) {
  std::vector<std::string> names;
  for (std::size_t from = 0; from <= text.size();) {
    const std::size_t comma = std::min(text.find(',', from), text.size());
    names.emplace_back(text.substr(from, comma - from));
    from = comma + 1;
  }
  return names;
}

}  // namespace

std::vector<FaultName> FaultNames() {
  std::vector<FaultName> names;
  for (const std::string& name : env::NoisePresetNames()) names.push_back({name, MeaningOfArmNoise(name)});
  for (const WorldNoise& world : kWorldNoises) names.push_back({world.name, world.meaning});
  for (const MeasuredNoise& measured : kMeasuredNoises) {
    names.push_back({std::string(measured.name) + "=NUMBER", measured.meaning});
  }
  for (const DrawnNoise& drawn : kDrawnNoises) {
    names.push_back({std::string(drawn.name) + "=FROM..TO", "the same, drawn per episode"});
  }
  return names;
}

namespace {

InputError UnknownNoise(const std::string& name) {
  std::string known;
  for (const FaultName& n : FaultNames()) known += (known.empty() ? "" : ", ") + n.name;
  return {"noise", "no noise is named '" + name + "'", "one of, or several with commas: " + known};
}

}  // namespace

EpisodeFaults ParseFaults(std::string_view text) {
  EpisodeFaults noise;
  noise.robot = env::NoisePreset("ideal");
  bool arm_given = false;
  std::vector<std::string> measured;  // these change what presets set
  std::vector<std::string> seen;
  for (const std::string& name : Split(text)) {
    if (std::find(seen.begin(), seen.end(), name) != seen.end()) {
      throw InputError("noise", "'" + name + "' stands twice", "give it once");
    }
    seen.push_back(name);
    const auto* world = std::find_if(std::begin(kWorldNoises), std::end(kWorldNoises),
                                     [&](const WorldNoise& candidate) { return name == candidate.name; });
    if (world != std::end(kWorldNoises)) {
      world->add(noise);
      continue;
    }
    if (name.find('=') != std::string::npos) {
      measured.push_back(name);
      continue;
    }
    const std::vector<std::string> arm = env::NoisePresetNames();
    if (std::find(arm.begin(), arm.end(), name) == arm.end()) {
      throw UnknownNoise(name);
    }
    if (name == "ideal") continue;
    if (arm_given) throw InputError("noise", "two noises of the arm", "give one of them");
    arm_given = true;
    noise.robot = env::NoisePreset(name);
  }
  for (const std::string& name : measured) {
    if (!AddDrawn(name, noise) && !AddMeasured(name, noise)) throw UnknownNoise(name);
  }
  if (noise.outside && noise.fall_in) {
    throw InputError("noise", "'outside' and 'fall-in' both say where the target stands", "give one of them");
  }
  if (!(noise.false_stop + noise.spent_step < 1.0)) {
    throw InputError("noise", "with that 'false-stop' and 'spent-step' the tool never moves", "give less of one");
  }
  noise.name = text;
  return noise;
}

}  // namespace feeler::workflow
