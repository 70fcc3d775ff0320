// Policy graphs: evaluated, expanded, drawn, written and read.
#include "feeler/core/file_output.h"
#include "feeler/planner/policy/evaluate.h"
#include "feeler/planner/policy/expand_policy.h"
#include "feeler/policies/io/policy_drawing.h"
#include "feeler/policies/io/policy_json.h"
#include "planner.h"

namespace feeler::python {

void BindPolicy(nb::module_& m) {
  nb::class_<BoundPolicy>(m, "PolicyGraph", "A frozen policy with its problem.")
      .def_prop_ro("problem", [](const BoundPolicy& p) { return p.problem; })
      .def_prop_ro("expected_cost", [](const BoundPolicy& p) { return p.graph->expected_cost; })
      .def_prop_ro("lower_bound", [](const BoundPolicy& p) { return p.graph->lower_bound; })
      .def("__len__", [](const BoundPolicy& p) { return p.graph->nodes.size(); })
      .def("evaluate",
           [](const BoundPolicy& p) {
             planner::PolicyEvaluation e;
             {
               const nb::gil_scoped_release released;
               e = planner::Evaluate(*p.problem, *p.graph);
             }
             nb::dict d;
             d["valid"] = e.valid();
             d["fault"] = e.fault;
             d["expected_cost"] = e.expected_cost;
             d["worst_cost"] = e.worst_cost;
             d["expected_moves"] = e.expected_moves;
             d["expected_contacts"] = e.expected_contacts;
             d["expected_cells"] = e.expected_cells;
             const std::size_t n = e.cost.size();
             d["cost"] = NewArray(std::move(e.cost), {n});
             return d;
           })
      .def("expand",
           [](const BoundPolicy& p) {
             const planner::ExpandedPolicy tree = planner::ExpandPolicy(*p.problem, *p.graph);
             nb::list nodes;
             for (const planner::ExpandedNode& node : tree.nodes) {
               nb::dict d;
               d["move"] = nb::none();
               if (!node.is_leaf())
                 d["move"] = nb::make_tuple(std::string(ToString(node.move.direction)), node.move.cells);
               nb::list outcomes;
               for (const planner::ExpandedBranch& branch : node.outcomes) {
                 outcomes.append(
                     nb::make_tuple(branch.outcome.cells, branch.outcome.contact, branch.next, branch.probability));
               }
               d["outcomes"] = outcomes;
               std::vector<std::int32_t> hypotheses(node.hypotheses.begin(), node.hypotheses.end());
               const std::size_t n = hypotheses.size();
               d["hypotheses"] = NewArray(std::move(hypotheses), {n});
               d["robot"] = Eigen::Vector3i(node.robot);
               d["probability"] = node.probability;
               d["expected_cost"] = node.expected_cost;
               nodes.append(d);
             }
             return nodes;
           })
      .def(
          "draw",
          [](const BoundPolicy& p, const std::string& format, const std::string& title, int max_depth,
             double min_probability) {
            const planner::ExpandedPolicy tree = planner::ExpandPolicy(*p.problem, *p.graph);
            const policies::PolicyDrawingOptions options{max_depth, min_probability};
            if (format == "dot") return policies::FormatPolicyDot(tree, title, options);
            if (format == "html") return policies::FormatPolicyHtml(tree, title, options);
            throw InputError("format", "unknown \"" + format + "\"", "choose dot or html");
          },
          "format"_a, "title"_a, "max_depth"_a, "min_probability"_a)
      .def(
          "json",
          [](const BoundPolicy& p, const std::string& task) {
            return policies::FormatPolicyFile(policies::ToPolicyFile(*p.problem, *p.graph, task));
          },
          "task"_a)
      .def(
          "save",
          [](const BoundPolicy& p, const std::string& path, const std::string& task) {
            WriteFileAtomically(path, policies::FormatPolicyFile(policies::ToPolicyFile(*p.problem, *p.graph, task)));
          },
          "path"_a, "task"_a);
  m.def(
      "read_policy",
      [](std::shared_ptr<const planner::Problem> problem, const std::string& path) {
        auto graph = std::make_shared<const planner::PolicyGraph>(
            policies::ToPolicy(policies::ReadPolicyFile(path), *problem, path));
        return BoundPolicy{std::move(problem), std::move(graph)};
      },
      "problem"_a, "path"_a);
}

}  // namespace feeler::python
