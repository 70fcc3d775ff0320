#pragma once

#include <map>
#include <string>
#include <utility>

namespace feeler::env {

/// A task file as text, made from its custom fields and the contents of its bodies. The default is a square peg over a
/// plate with a square hole: the smallest task that is complete.
struct TaskText {
  std::map<std::string, std::string> texts = {
      {"feeler_axes", "x y z"}, {"feeler_insertion_axis", "-z"}, {"feeler_goal", "singleton"}};
  std::map<std::string, std::string> numbers = {{"feeler_resolution", "0.002 0.002 0.002"},
                                                {"feeler_min_cells", "2 2 2"},
                                                {"feeler_max_cells", "5 5 5"},
                                                {"feeler_start_offset", "0 0 0.02"},
                                                {"feeler_workspace", "0.02 0.02 0.02"},
                                                {"feeler_move_lengths", "1 2 4"},
                                                {"feeler_insertion_depth", "0.01"},
                                                {"feeler_tolerance_lateral", "0.0005"},
                                                {"feeler_tolerance_vertical", "0.002"},
                                                {"feeler_tolerance_angle", "0.03"},
                                                {"feeler_cost", "1 0 0"},
                                                {"feeler_flange_position", "0 0 0.1"},
                                                {"feeler_flange_quaternion", "0 1 0 0"}};
  std::string tool = R"(<geom name="peg" type="box" size="0.004 0.004 0.015" pos="0 0 0.015"/>)";
  std::string target = R"(
      <geom name="west" type="box" size="0.01 0.03 0.01" pos="-0.015 0 -0.01"/>
      <geom name="east" type="box" size="0.01 0.03 0.01" pos="0.015 0 -0.01"/>
      <geom name="south" type="box" size="0.01 0.01 0.01" pos="0 -0.015 -0.01"/>
      <geom name="north" type="box" size="0.01 0.01 0.01" pos="0 0.015 -0.01"/>
      <geom name="lid" type="box" size="0.005 0.005 0.01" pos="0 0 -0.01" contype="0" conaffinity="0"/>)";
  std::string tool_body = R"(<body name="tool" pos="0.6 0 0.3">)";
  std::string target_body = R"(<body name="target" pos="0.6 0 0.2">)";
  std::string extra;  ///< children of <mujoco>

  std::string Mjcf() const {
    std::string mjcf = "<mujoco>\n<custom>\n";
    for (const auto& [name, value] : texts) mjcf += "<text name=\"" + name + "\" data=\"" + value + "\"/>\n";
    for (const auto& [name, value] : numbers) mjcf += "<numeric name=\"" + name + "\" data=\"" + value + "\"/>\n";
    mjcf += "</custom>\n" + extra + "\n<worldbody>\n";
    if (!tool_body.empty()) mjcf += tool_body + tool + "</body>\n";
    if (!target_body.empty()) mjcf += target_body + target + "</body>\n";
    return mjcf + "</worldbody>\n</mujoco>\n";
  }
};

/// An asset: a frame, a square of half width `outer_m` with a square hole of 10 mm, as one closed mesh.
inline std::string FrameMesh(double outer_m) {
  std::string v;
  for (const char* z : {"0", "-0.02"}) {
    for (const double s : {outer_m, 0.005}) {
      for (const auto& [x, y] : {std::pair{-s, -s}, {s, -s}, {s, s}, {-s, s}}) {
        v += std::to_string(x) + " " + std::to_string(y) + " " + z + "  ";
      }
    }
  }
  const int quads[16][4] = {{0, 1, 5, 4},   {1, 2, 6, 5},    {2, 3, 7, 6},     {3, 0, 4, 7},
                            {8, 12, 13, 9}, {9, 13, 14, 10}, {10, 14, 15, 11}, {11, 15, 12, 8},
                            {0, 8, 9, 1},   {1, 9, 10, 2},   {2, 10, 11, 3},   {3, 11, 8, 0},
                            {4, 5, 13, 12}, {5, 6, 14, 13},  {6, 7, 15, 14},   {7, 4, 12, 15}};
  std::string f;
  for (const auto& q : quads) {
    for (const int i : {0, 1, 2, 0, 2, 3}) f += std::to_string(q[i]) + " ";
  }
  return "<asset><mesh name=\"frame\" vertex=\"" + v + "\" face=\"" + f + "\"/></asset>";
}

}  // namespace feeler::env
