// The fingerprints of the tasks that ship, as they have been since databases are made for them. Law: none ever changes
// while its geometry, lattice, costs and goal stay; else every database in the field is refused. A new task adds a
// line.

#include <gtest/gtest.h>

#include <map>
#include <string>

#include "feeler/env/model/fingerprint.h"
#include "feeler/env/model/task_file.h"

namespace feeler::env {
namespace {

const std::map<std::string, std::string> kShipped = {
    {"elbow-onto-pipe", "61e9e1a03dd5f63792f2c500edc6da00"},
    {"elbow-onto-pipe-sideways", "61e9e1a03dd5f63792f2c500edc6da00"},
    {"pipe-into-elbow", "6be917606108e5655a3e93997510d27a"},
    {"pipe-into-elbow-sideways", "6be917606108e5655a3e93997510d27a"},
    {"plug", "9c7a0ec861ec7183024276d322d86761"},
    {"plug-black", "9c7a0ec861ec7183024276d322d86761"},
    {"plug-black-on-white", "9c7a0ec861ec7183024276d322d86761"},
    {"plug-fine", "2d304970b6c823d53f1a20865076ac02"},
    {"plug-flush", "c6e15a2b7c4adff1474d58556a1f5221"},
    {"plug-red-tape", "9c7a0ec861ec7183024276d322d86761"},
    {"plug-textured", "9c7a0ec861ec7183024276d322d86761"},
    {"plug-tight", "f7c9efcf23b3212f145f4d314e1f0cd7"},
    {"plug-two-axes", "cc080cb87c34bb2f3333a0bde9e3b8a1"},
    {"rectangular-plug", "90aa43de2e021a2209305fc2d7a7933f"},
    {"round-peg", "80b09d516237ce1dafc2945f1323fb54"},
};

TEST(ShippedFingerprints, Stay) {
  for (const std::string& name : ListTasks()) {
    const auto pinned = kShipped.find(name);
    ASSERT_NE(pinned, kShipped.end()) << name << ": pin the fingerprint of a new task here";
    EXPECT_EQ(Fingerprint(LoadTask(name), Opening::kClosed), pinned->second) << name;
  }
  EXPECT_EQ(ListTasks().size(), kShipped.size());
}

}  // namespace
}  // namespace feeler::env
