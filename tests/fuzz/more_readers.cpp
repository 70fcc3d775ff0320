// Readers that take a file, or that link the simulator, CAD or the report.
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>

#include "feeler/cad/readers/read_part.h"
#include "feeler/cad/step/read_step.h"
#include "feeler/core/data_folder.h"
#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "feeler/env/arm/urdf_to_mjcf.h"
#include "feeler/env/model/task_file.h"
#include "feeler/evaluation/report/record_line.h"
#include "feeler/execution/remote/cell_file.h"
#include "feeler/policies/storage/database.h"
#include "feeler/policies/storage/task_bundle.h"
#include "feeler/workflow/assembly/assembly.h"
#include "tests/cad/kinds/part_shapes.h"
#include "tests/env/task_text.h"
#include "tests/fuzz/readers.h"

namespace feeler::fuzz {
namespace {

namespace fs = std::filesystem;

/// A folder of this process for the files that are read; it goes with the process.
const fs::path& Folder() {
  struct Own {
    fs::path path;
    Own() {
      std::string name = (fs::temp_directory_path() / "feeler-fuzz-XXXXXX").string();
      path = mkdtemp(name.data());
    }
    ~Own() {
      std::error_code ignored;
      fs::remove_all(path, ignored);
    }
  };
  static const Own kOwn;
  return kOwn.path;
}

std::string AsFile(std::string_view bytes, const char* name) {
  const std::string path = (Folder() / name).string();
  std::ofstream(path, std::ios::binary) << bytes;
  return path;
}

std::string Slurp(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void Mesh(std::string_view bytes, const char* name) { cad::ReadPart({AsFile(bytes, name), ""}, {}); }

void Step(std::string_view bytes) {
  cad::ReadPart({AsFile(bytes, "input.step"), ""}, [](const fs::path& file) { return cad::ReadStep(file); });
}

void Database(std::string_view bytes) {
  policies::Database database = policies::Database::OpenReadOnly(AsFile(bytes, "input.db"));
  database.Info();
  database.ForEach([](const policies::StoredProblem&) {});
}

void Urdf(std::string_view bytes) {
  tinyxml2::XMLDocument document;
  tinyxml2::XMLElement* mujoco = document.NewElement("mujoco");
  document.InsertEndChild(mujoco);
  env::EmitRobot(AsFile(bytes, "input.urdf"), {}, *mujoco);
}

void Record(std::string_view bytes) {
  nlohmann::json record;
  try {
    evaluation::ReadRecordLine(std::string(bytes), record);
  } catch (const std::invalid_argument& fault) {  // its own kind of refusal: a fault that the report's page lists
    throw InputError("line", fault.what(), "run what wrote it again");
  }
}

void Task(std::string_view bytes) { env::LoadTaskFromText(std::string(bytes), "input", Folder()); }

constexpr std::array kMoreReaders{
    Reader{"record", Record},
    Reader{"bundle", [](std::string_view b) { policies::ReadBundle(AsFile(b, "input.db.bundle")); }},
    Reader{"cell", [](std::string_view b) { execution::ReadCellFile(AsFile(b, "cell.json")); }},
    Reader{"assembly", [](std::string_view b) { workflow::LoadAssembly(AsFile(b, "assembly.json")); }},
    Reader{"task", Task, true},
    Reader{"urdf", Urdf, true},
    Reader{"database", Database, true},
    Reader{"stl", [](std::string_view b) { Mesh(b, "input.stl"); }},
    Reader{"obj", [](std::string_view b) { Mesh(b, "input.obj"); }},
    Reader{"3mf", [](std::string_view b) { Mesh(b, "input.3mf"); }},
    Reader{"ply", [](std::string_view b) { Mesh(b, "input.ply"); }},
    Reader{"step", Step}};

/// A database of one problem, or the bundle of its task.
std::string SmallDatabase(bool bundle) {
  const std::string path = (Folder() / "seed.db").string();
  if (bundle) {
    policies::TaskBundle content;
    content.fingerprint = "0";
    content.opening = "closed";
    content.task = env::LoadTaskFromText(env::TaskText().Mjcf(), "peg").task;
    const CellBox box{{-1, -1, 0}, {1, 1, 2}};
    planner::ContactMap::Layer layer;
    layer.blocked.assign(static_cast<std::size_t>(box.Count()), 0);
    for (std::vector<float>& travel : layer.travel) travel.assign(layer.blocked.size(), 2.5F);
    content.map =
        std::make_shared<const planner::ContactMap>(box, std::vector{layer}, Eigen::Vector3d(0.1, 0.2, 0.3), 0.4);
    policies::WriteBundle(path + ".bundle", content);
    return Slurp(path + ".bundle");
  }
  policies::DatabaseIdentity identity;
  identity.task = "peg";
  identity.fingerprint = "0";
  identity.opening = "closed";
  identity.goal = "singleton";
  identity.settings = "{}";
  identity.created_by = "fuzz";
  fs::remove(path);
  policies::Database::Create(path, identity);
  return Slurp(path);
}

std::vector<std::string> Meshes(std::string_view kind) {
  if (kind == "obj") return {"o part\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"};
  if (kind == "ply") {
    return {
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 4\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
        "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n"};
  }
  const std::string facet =
      "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
  std::string binary(84, '\0');
  binary[80] = 2;
  binary += std::string(100, '\x3e');
  return {"solid part\n" + facet + facet + "endsolid part\n", binary};
}

}  // namespace

std::span<const Reader> MoreReaders() { return kMoreReaders; }

std::vector<std::string> MoreSeeds(const Reader& reader) {
  const std::string_view name = reader.name;
  if (name == "record") {
    return {
        R"({"task":"plug","policy":"database","noise":"ideal","seed":1,"episode":0,"extents":[2,2,2],"inserted":true,)"
        R"("localized":true,"reason":"inserted","moves":[],"contacts":1,"ladder":[],"error":{"lateral_m":0.0001},)"
        R"("sim_time_s":1.5,"path_length_m":0.1,"policy_moves":3,"peak_force_n":9.5,"timing":{"plan_cpu_s":0.1}})"};
  }
  if (name == "bundle") return {SmallDatabase(true)};
  if (name == "database") return {SmallDatabase(false)};
  if (name == "cell") {
    execution::CellFile cell;
    cell.tool = "plug";
    cell.stiffness_n_m = 6e4;
    const std::string path = (Folder() / "seed.json").string();
    fs::remove(path);
    execution::WriteCellFile(path, cell);
    return {Slurp(path)};
  }
  if (name == "assembly") return {Slurp(FindData("models") / "assemblies/frame.json")};
  if (name == "urdf") return {Slurp(FindData("models") / "robots/ur10e.urdf")};
  if (name == "task") return {env::TaskText().Mjcf()};
  if (name == "step" || name == "3mf") {
    // The smallest of the parts that can be drawn.
    const cad::PartFiles files = cad::WriteParts("rectangle", Folder(), std::string(name));
    return {Slurp(files.tool)};
  }
  return Meshes(name);
}

}  // namespace feeler::fuzz
