#include "feeler/env/model/contact_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string_view>
#include <utility>

#include "feeler/core/error.h"

namespace feeler::env {
namespace {

std::string Element(const std::string& where, const mjModel& model, int geom) {
  const char* name = mj_id2name(&model, mjOBJ_GEOM, geom);
  if (name != nullptr) return fmt::format("{}: <geom name=\"{}\">", where, name);
  const char* body = mj_id2name(&model, mjOBJ_BODY, model.geom_bodyid[geom]);
  return fmt::format("{}: <geom> number {} of body \"{}\"", where,
                     geom - model.body_geomadr[model.geom_bodyid[geom]] + 1, body == nullptr ? "" : body);
}

bool Collides(const mjModel& model, int geom) {
  return model.geom_contype[geom] != 0 || model.geom_conaffinity[geom] != 0;
}

bool Meet(const mjModel& model, int a, int b) {
  return (model.geom_contype[a] & model.geom_conaffinity[b]) != 0 ||
         (model.geom_contype[b] & model.geom_conaffinity[a]) != 0;
}

bool Inside(const mjModel& model, int body, int ancestor) {
  while (body > ancestor) body = model.body_parentid[body];
  return body == ancestor;
}

void AddMargins(const mjModel& model, const std::string& where, TaskFindings& findings) {
  for (int geom = 0; geom < model.ngeom; ++geom) {
    if (!Collides(model, geom)) continue;
    for (const auto& [value, attribute] :
         {std::pair{model.geom_margin[geom], "margin"}, {model.geom_gap[geom], "gap"}}) {
      if (value == 0) continue;
      findings.push_back({TaskFinding::Severity::kError, attribute, Element(where, model, geom),
                          fmt::format("{}=\"{}\" moves where physics feels contact by {:.3g} mm, which the contact map "
                                      "does not know",
                                      attribute, value, value * 1000),
                          fmt::format("set {}=\"0\" on it or in its <default>", attribute)});
    }
  }
}

void AddMasks(const TaskModel& task_model, const std::string& where, TaskFindings& findings) {
  const mjModel& model = *task_model.model;
  for (const int tool : task_model.tool_geoms) {
    int passed = 0;
    int first = -1;
    for (const int target : task_model.target_geoms) {
      if (Meet(model, tool, target)) continue;
      if (passed++ == 0) first = target;
    }
    if (passed == 0) continue;
    findings.push_back(
        {TaskFinding::Severity::kError, "contype", Element(where, model, tool),
         fmt::format("contype {} and conaffinity {} let it pass through {} of the {} geoms of the target in physics "
                     "(the first has {} and {}); the contact map lets all touch all",
                     model.geom_contype[tool], model.geom_conaffinity[tool], passed, task_model.target_geoms.size(),
                     model.geom_contype[first], model.geom_conaffinity[first]),
         "give both contype=\"1\" conaffinity=\"1\", or both \"0\" to what is only seen"});
  }
}

void AddSections(const TaskModel& task_model, const std::string& where, TaskFindings& findings) {
  const mjModel& model = *task_model.model;
  const auto add = [&](const char* kind, const std::string& element, const std::string& what, const char* mend) {
    findings.push_back({TaskFinding::Severity::kError, kind, where + ": " + element, what, mend});
  };
  if (model.npair > 0) {
    add("pair", "<contact><pair>", fmt::format("{} explicit pairs change how contact is found", model.npair),
        "remove them: contact is by contype and conaffinity");
  }
  for (int i = 0; i < model.nexclude; ++i) {
    const int one = (model.exclude_signature[i] >> 16) - 1;
    const int other = (model.exclude_signature[i] & 0xffff) - 1;
    for (const int body : {task_model.tool_body, task_model.target_body}) {
      if (!Inside(model, one, body) && !Inside(model, other, body)) continue;
      add("exclude", "<contact><exclude>", "lets tool or target pass through another body, unseen by the contact map",
          "remove it");
      break;
    }
  }
  if (model.neq > 0) {
    add("equality", "<equality>", fmt::format("{} constraints hold bodies where the task does not put them", model.neq),
        "remove them: tool and target are rigid");
  }
  if ((model.opt.enableflags & mjENBL_OVERRIDE) != 0) {
    add("override", "<option><flag override>", "overrides the contact parameters of all geoms", "remove the flag");
  }
}

}  // namespace

TaskFindings ContactSettingFindings(const TaskModel& task_model, const std::string& where) {
  TaskFindings findings;
  AddMargins(*task_model.model, where, findings);
  AddMasks(task_model, where, findings);
  AddSections(task_model, where, findings);
  return findings;
}

void RequireSaneContactParameters(const mjModel& model, const std::string& where) {
  for (int geom = 0; geom < model.ngeom; ++geom) {
    const auto refuse = [&](const std::string& what, const char* mend) {
      throw InputError(Element(where, model, geom), what, mend);
    };
    for (int i = 0; i < 3; ++i) {
      const double friction = model.geom_friction[3 * geom + i];
      if (!(friction >= 0 && friction <= 1e3))
        refuse(fmt::format("friction {} is not in 0 to 1000", friction), "0.3 is common");
    }
    const double* solref = model.geom_solref + mjNREF * geom;
    const bool times = solref[0] > 0 && solref[1] > 0;
    const bool stiffness = solref[0] < 0 && solref[1] <= 0;
    if (!times && !stiffness) {
      refuse(
          fmt::format("solref \"{} {}\" is neither a time constant with a damping ratio nor a stiffness with a damping",
                      solref[0], solref[1]),
          "\"0.01 1\" is common");
    }
    const double* solimp = model.geom_solimp + mjNIMP * geom;
    for (int i = 0; i < 2; ++i) {
      if (!(solimp[i] > 0 && solimp[i] <= 1))
        refuse(fmt::format("solimp {} is not in 0 to 1", solimp[i]), "\"0.95 0.99 0.0005\" is common");
    }
    if (!(solimp[3] >= 0 && solimp[3] <= 1 && solimp[4] >= 1)) {
      refuse(fmt::format("midpoint and power of solimp are {} and {}", solimp[3], solimp[4]), "0.5 2 is common");
    }
    if (!(model.geom_solmix[geom] >= 0)) {
      refuse(fmt::format("solmix {} is negative", model.geom_solmix[geom]), "1 is common");
    }
    if (!(solimp[2] >= 0)) refuse(fmt::format("the width {} of solimp is negative", solimp[2]), "0.0005 is common");
  }
}

std::map<std::string, double> ContactParameters(const mjModel& model, const std::vector<int>& tool_geoms,
                                                const std::vector<int>& target_geoms, int tool_body, int target_body) {
  std::map<std::string, double> parameters;
  std::uint32_t digest = 2166136261U;  // FNV-1a
  const auto add = [&](const mjtNum* values, int count) {
    const auto* bytes = reinterpret_cast<const unsigned char*>(values);
    for (std::size_t i = 0; i < static_cast<std::size_t>(count) * sizeof(mjtNum); ++i) {
      digest = (digest ^ bytes[i]) * 16777619U;
    }
  };
  const auto range = [&](const std::string& name, double value) {
    const auto [least, is_new] = parameters.emplace(name + "_least", value);
    const auto most = parameters.emplace(name + "_most", value).first;
    least->second = std::min(least->second, value);
    most->second = std::max(most->second, value);
  };
  for (const std::vector<int>* geoms : {&tool_geoms, &target_geoms}) {
    for (const int geom : *geoms) {
      range("friction", model.geom_friction[3 * geom]);
      range("solref_0", model.geom_solref[mjNREF * geom]);
      range("solref_1", model.geom_solref[mjNREF * geom + 1]);
      range("solimp_0", model.geom_solimp[mjNIMP * geom]);
      range("solimp_1", model.geom_solimp[mjNIMP * geom + 1]);
      add(model.geom_friction + 3 * geom, 3);
      add(model.geom_solref + mjNREF * geom, mjNREF);
      add(model.geom_solimp + mjNIMP * geom, mjNIMP);
      const mjtNum others[] = {static_cast<mjtNum>(model.geom_condim[geom]),
                               static_cast<mjtNum>(model.geom_priority[geom]), model.geom_solmix[geom]};
      add(others, 3);
    }
  }
  for (const auto& [name, body] : {std::pair{"tool_mass_kg", tool_body}, {"target_mass_kg", target_body}}) {
    parameters[name] = model.body_mass[body];
    add(model.body_mass + body, 1);
    add(model.body_inertia + 3 * body, 3);
  }
  parameters["digest"] = digest;
  return parameters;
}

void RequireNoError(const TaskFindings& findings) {
  for (const TaskFinding& finding : findings) {
    if (finding.severity == TaskFinding::Severity::kError) throw InputError(finding.where, finding.what, finding.mend);
  }
}

}  // namespace feeler::env
