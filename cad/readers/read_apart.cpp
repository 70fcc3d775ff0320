#include "feeler/cad/readers/read_apart.h"

#include <fmt/format.h>

#include <csignal>
#include <cstring>
#include <exception>
#include <new>
#include <utility>
#include <vector>

#include "feeler/cad/readers/run_apart.h"
#include "feeler/core/error.h"

namespace feeler::cad {
namespace {

/// A part, or a refusal, as bytes of this program for itself.
class Writer {
 public:
  template <typename T>
  void Value(const T& value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  template <typename T>
  void All(const std::vector<T>& values) {
    Value(values.size());
    if (!values.empty()) bytes_.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
  }
  void Text(const std::string& text) {
    Value(text.size());
    bytes_ += text;
  }
  std::string Take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

class Reader {
 public:
  explicit Reader(const std::string& bytes) : bytes_(bytes) {}
  template <typename T>
  T Value() {
    T value;
    std::memcpy(&value, bytes_.data() + at_, sizeof value);
    at_ += sizeof value;
    return value;
  }
  template <typename T>
  std::vector<T> All() {
    std::vector<T> values(Value<std::size_t>());
    if (!values.empty()) std::memcpy(static_cast<void*>(values.data()), bytes_.data() + at_, values.size() * sizeof(T));
    at_ += values.size() * sizeof(T);
    return values;
  }
  std::string Text() {
    const auto size = Value<std::size_t>();
    std::string text = bytes_.substr(at_, size);
    at_ += size;
    return text;
  }

 private:
  const std::string& bytes_;
  std::size_t at_ = 0;
};

std::string Pack(const RawPart& part) {
  Writer to;
  to.Value(true);
  to.Text(part.format);
  to.Value(part.unit.has_value());
  to.Text(part.unit ? part.unit->name : "");
  to.Value(part.unit ? part.unit->metres : 0.0);
  to.Value(part.unit_is_stated);
  to.Value(part.notes.size());
  for (const std::string& note : part.notes) to.Text(note);
  to.Value(part.bodies.size());
  for (const RawBody& body : part.bodies) {
    to.Text(body.name);
    to.Text(body.group);
    to.All(body.mesh.points);
    to.All(body.mesh.triangles);
  }
  return to.Take();
}

std::string Pack(const Refusal& refusal) {
  Writer to;
  to.Value(false);
  to.Text(refusal.what);
  to.Text(refusal.mend);
  return to.Take();
}

RawPart Unpack(const std::filesystem::path& file, const std::string& bytes) {
  Reader from(bytes);
  if (!from.Value<bool>()) {
    const std::string what = from.Text();
    throw InputError(file.string(), what, from.Text());
  }
  RawPart part;
  part.format = from.Text();
  const bool has_unit = from.Value<bool>();
  Unit unit{from.Text(), 0.0};
  unit.metres = from.Value<double>();
  if (has_unit) part.unit = std::move(unit);
  part.unit_is_stated = from.Value<bool>();
  part.notes.resize(from.Value<std::size_t>());
  for (std::string& note : part.notes) note = from.Text();
  part.bodies.resize(from.Value<std::size_t>());
  for (RawBody& body : part.bodies) {
    body.name = from.Text();
    body.group = from.Text();
    body.mesh.points = from.All<Eigen::Vector3d>();
    body.mesh.triangles = from.All<std::array<int, 3>>();
  }
  return part;
}

}  // namespace

RawPart ReadApart(const std::filesystem::path& file, const std::string& library, const std::function<RawPart()>& read) {
  constexpr const char* kMend = "export it again, or as STL";
  std::string bytes;
  try {
    bytes = RunApart([&] {
      try {
        return Pack(read());
      } catch (const Refusal& refusal) {
        return Pack(refusal);
      } catch (const std::bad_alloc&) {
        throw;
      } catch (const std::exception& error) {
        return Pack(Refusal{fmt::format("{} fails: {}", library, error.what()), kMend});
      }
    });
  } catch (const ChildDied& died) {
    throw InputError(file.string(),
                     died.signal == SIGXCPU ? fmt::format("{} comes to no end with it", library)
                                            : fmt::format("{} dies of it (signal {})", library, died.signal),
                     kMend);
  }
  return Unpack(file, bytes);
}

}  // namespace feeler::cad
