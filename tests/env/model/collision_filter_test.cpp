// Laws of the collision filter and of the physics model: with the filter MuJoCo finds the same contacts, bit for bit,
// as without, at random configurations of every task, with margins and without (oracle: MuJoCo's own filter); the boxes
// that the filter takes for meshes contain them; the pruned model moves as the full one (same masses, same contacts, up
// to rounding) and is the smaller one; colliding geoms and lids stay.

#include "feeler/env/model/collision_filter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "feeler/core/random.h"
#include "feeler/env/model/mujoco_handles.h"
#include "feeler/env/model/task_file.h"
#include "feeler/env/scene/scene.h"

namespace feeler::env {
namespace {

struct Touch {
  std::string body1, body2;
  double distance_m, x_m;
  bool operator==(const Touch&) const = default;
};

std::vector<Touch> Touches(const mjModel& model, mjData& data) {
  mj_kinematics(&model, &data);
  mj_comPos(&model, &data);  // resets nothing, but completes what collision may read
  mj_collision(&model, &data);
  std::vector<Touch> touches;
  for (int i = 0; i < data.ncon; ++i) {
    const mjContact& c = data.contact[i];
    const auto body = [&](int geom) { return std::string(mj_id2name(&model, mjOBJ_BODY, model.geom_bodyid[geom])); };
    touches.push_back({body(c.geom1), body(c.geom2), c.dist, c.pos[0]});
  }
  TakeMujocoWarning();
  return touches;
}

class FilteredScene : public testing::TestWithParam<std::string> {
 protected:
  void TearDown() override { mjcb_contactfilter = filter_; }
  mjfConFilt filter_ = (RouteMujocoMessages(), mjcb_contactfilter);
};

TEST_P(FilteredScene, FindsTheSameContacts) {
  const Scene scene = BuildScene(LoadTask(GetParam()));
  for (const double margin_m : {0.0, 0.004}) {
    ModelHandle model(mj_copyModel(nullptr, scene.model.get()));
    std::fill(model->geom_margin, model->geom_margin + model->ngeom, margin_m);
    const DataHandle data = MakeData(*model);
    RandomStream random(3, 0, "filter");
    ResetScene(scene, scene.home_q_rad, *data);
    int seen = 0;
    for (int sample = 0; sample < 400; ++sample) {
      // Half of the samples about the opening, half anywhere.
      JointVector q;
      const Pose near = scene.task.world_T_target * MakePose({random.Uniform(-0.05, 0.05), random.Uniform(-0.05, 0.05),
                                                              random.Uniform(-0.03, 0.01)},
                                                             random.Uniform(-0.3, 0.3));
      const auto branches = ToolInverseKinematics(scene, near);
      if (sample % 2 == 0 && !branches.empty()) {
        q = branches[random.Index(branches.size())];
      } else {
        for (double& angle : q) angle = random.Uniform(-3.0, 3.0);
      }
      SetJointPositions(scene, q, *data);
      mjcb_contactfilter = filter_;
      const auto with = Touches(*model, *data);
      mjcb_contactfilter = nullptr;
      const auto without = Touches(*model, *data);
      ASSERT_EQ(with, without) << sample;
      seen += static_cast<int>(with.size());
    }
    EXPECT_GT(seen, 200);
  }
}

TEST_P(FilteredScene, BoxesContainTheirMeshes) {
  const Scene scene = BuildScene(LoadTask(GetParam()));
  const mjModel& m = *scene.model;
  for (int geom = 0; geom < m.ngeom; ++geom) {
    if (m.geom_type[geom] != mjGEOM_MESH) continue;
    const int mesh = m.geom_dataid[geom];
    for (int v = m.mesh_vertadr[mesh]; v < m.mesh_vertadr[mesh] + m.mesh_vertnum[mesh]; ++v) {
      for (int i = 0; i < 3; ++i) {
        EXPECT_LE(std::abs(static_cast<double>(m.mesh_vert[3 * v + i])), m.geom_size[3 * geom + i] + 1e-6);
      }
    }
  }
}

TEST_P(FilteredScene, ThePhysicsModelIsTheDrawnOneLessWhatIsOnlySeen) {
  const Scene scene = BuildScene(LoadTask(GetParam()));
  const mjModel& small = *scene.model;
  const mjModel& full = *scene.drawn_model;
  EXPECT_LT(small.ngeom, full.ngeom);
  EXPECT_EQ(small.ntexdata, 0);
  ASSERT_EQ(small.nbody, full.nbody);
  ASSERT_EQ(small.nq, full.nq);
  ASSERT_EQ(small.nmocap, full.nmocap);
  const auto colliding = [](const mjModel& m) {
    int count = 0;
    for (int g = 0; g < m.ngeom; ++g) count += m.geom_contype[g] != 0 || m.geom_conaffinity[g] != 0;
    return count;
  };
  EXPECT_EQ(colliding(small), colliding(full));
  EXPECT_EQ(static_cast<std::size_t>(small.ngeom - colliding(small)), scene.lid_geoms.size());

  const DataHandle a = MakeData(small);
  const DataHandle b = MakeData(full);
  ResetScene(scene, scene.home_q_rad, *a);
  CopyForDrawing(scene, *a, *b);
  mj_forward(&full, b.get());
  for (int step = 0; step < 300; ++step) {
    for (int i = 0; i < kJointCount; ++i) a->ctrl[i] = b->ctrl[i] = 0.5 * a->qfrc_bias[i];
    mj_step(&small, a.get());
    mj_step(&full, b.get());
  }
  for (int i = 0; i < small.nq; ++i) EXPECT_NEAR(a->qpos[i], b->qpos[i], 1e-9);
  EXPECT_EQ(a->ncon, b->ncon);
}

INSTANTIATE_TEST_SUITE_P(Models, FilteredScene, testing::ValuesIn(ListTasks()), [](const auto& task) {
  std::string name = task.param;
  std::replace_if(
      name.begin(), name.end(), [](unsigned char letter) { return std::isalnum(letter) == 0; }, '_');
  return name;
});

}  // namespace
}  // namespace feeler::env
