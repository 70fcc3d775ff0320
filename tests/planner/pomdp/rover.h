#pragma once

#include <string>

namespace feeler::planner {

/// A rover on three cells (rock at s0, start s1, exit s2), after the tutorial of the format.
inline std::string Rover(const std::string& transitions, const std::string& sensor) {
  return R"(<?xml version="1.0" encoding="ISO-8859-1"?>
<pomdpx version="1.0" id="rover">
<Discount>0.95</Discount>
<Variable>
<StateVar vnamePrev="rover_0" vnameCurr="rover_1" fullyObs="true"><NumValues>3</NumValues></StateVar>
<StateVar vnamePrev="rock_0" vnameCurr="rock_1"><ValueEnum>good bad</ValueEnum></StateVar>
<ObsVar vname="sensor"><ValueEnum>ogood obad</ValueEnum></ObsVar>
<ActionVar vname="action"><ValueEnum>west east check sample</ValueEnum></ActionVar>
<RewardVar vname="r"/>
</Variable>
<InitialStateBelief>
<CondProb><Var>rover_0</Var><Parent>null</Parent><Parameter type="TBL"><Entry><Instance>-</Instance><ProbTable>0.0 1.0 0.0</ProbTable></Entry></Parameter></CondProb>
<CondProb><Var>rock_0</Var><Parent>null</Parent><Parameter type="TBL"><Entry><Instance>-</Instance><ProbTable>uniform</ProbTable></Entry></Parameter></CondProb>
</InitialStateBelief>
<StateTransitionFunction>
)" + transitions +
         R"(
</StateTransitionFunction>
<ObsFunction>
)" + sensor +
         R"(
</ObsFunction>
<RewardFunction>
<Func><Var>r</Var><Parent>action rover_0</Parent><Parameter type="TBL">
<Entry><Instance>east s1</Instance><ValueTable>10</ValueTable></Entry>
<Entry><Instance>west s0</Instance><ValueTable>-100</ValueTable></Entry>
<Entry><Instance>sample s1</Instance><ValueTable>-100</ValueTable></Entry></Parameter></Func>
<Func><Var>r</Var><Parent>action rover_0 rock_0</Parent><Parameter type="TBL">
<Entry><Instance>sample s0 -</Instance><ValueTable>10 -10</ValueTable></Entry></Parameter></Func>
</RewardFunction>
</pomdpx>
)";
}

inline std::string Entry(const std::string& instance, const std::string& table) {
  return "<Entry><Instance>" + instance + "</Instance><ProbTable>" + table + "</ProbTable></Entry>\n";
}

inline const std::string kTableTransitions =
    "<CondProb><Var>rover_1</Var><Parent>action rover_0</Parent><Parameter type=\"TBL\">" + Entry("* - -", "identity") +
    Entry("west s1 -", "1 0 0") + Entry("west s0 -", "0 0 1") + Entry("east s0 -", "0.0 1.0 0.0") +
    Entry("east s1 s2", "1.0") + Entry("east s1 s1", "0.0") + Entry("sample s1 -", "0 0 1") +
    "</Parameter></CondProb>"
    "<CondProb><Var>rock_1</Var><Parent>action rover_0 rock_0</Parent><Parameter type=\"TBL\">" +
    Entry("* * - -", "1.0 0.0 0.0 1.0") + Entry("sample s0 * -", "0.0 1.0") + "</Parameter></CondProb>";
inline const std::string kTableSensor =
    "<CondProb><Var>sensor</Var><Parent>action rover_1 rock_1</Parent><Parameter type=\"TBL\">" +
    Entry("* * * -", "1.0 0.0") + Entry("check s0 - -", "1.0 0.0 0.0 1.0") + Entry("check s1 - -", "0.8 0.2 0.2 0.8") +
    "</Parameter></CondProb>";

inline const std::string kDiagramTransitions = R"(
<CondProb><Var>rover_1</Var><Parent>action rover_0</Parent><Parameter type="DD"><DAG><Node var="action">
<Edge val="west"><Node var="rover_0"><Edge val="s0"><SubDAG type="deterministic" var="rover_1" val="s2"/></Edge>
<Edge val="s1"><SubDAG type="deterministic" var="rover_1" val="s0"/></Edge><Edge val="s2"><SubDAG type="persistent" var="rover_1"/></Edge></Node></Edge>
<Edge val="east"><Node var="rover_0"><Edge val="s0"><SubDAG type="deterministic" var="rover_1" val="s1"/></Edge>
<Edge val="s1"><SubDAG type="deterministic" var="rover_1" val="s2"/></Edge><Edge val="s2"><SubDAG type="persistent" var="rover_1"/></Edge></Node></Edge>
<Edge val="check"><SubDAG type="persistent" var="rover_1"/></Edge>
<Edge val="sample"><Node var="rover_0"><Edge val="s0"><SubDAG type="persistent" var="rover_1"/></Edge>
<Edge val="s1"><Node var="rover_1"><Edge val="s0"><Terminal>0.0</Terminal></Edge><Edge val="s1"><Terminal>0.0</Terminal></Edge><Edge val="s2"><Terminal>1.0</Terminal></Edge></Node></Edge>
<Edge val="s2"><SubDAG type="persistent" var="rover_1"/></Edge></Node></Edge>
</Node></DAG></Parameter></CondProb>
<CondProb><Var>rock_1</Var><Parent>action rover_0 rock_0</Parent><Parameter type="DD"><DAG><Node var="action">
<Edge val="west"><SubDAG type="template" idref="same"/></Edge><Edge val="east"><SubDAG type="template" idref="same"/></Edge>
<Edge val="check"><SubDAG type="template" idref="same"/></Edge>
<Edge val="sample"><Node var="rover_0"><Edge val="s0"><SubDAG type="deterministic" var="rock_1" val="bad"/></Edge>
<Edge val="s1"><SubDAG type="template" idref="same"/></Edge><Edge val="s2"><SubDAG type="template" idref="same"/></Edge></Node></Edge>
</Node></DAG><SubDAGTemplate id="same"><SubDAG type="persistent" var="rock_1"/></SubDAGTemplate></Parameter></CondProb>
)";
inline const std::string kDiagramSensor = R"(
<CondProb><Var>sensor</Var><Parent>action rover_1 rock_1</Parent><Parameter type="DD"><DAG><Node var="action">
<Edge val="west"><SubDAG type="template" idref="yes"/></Edge><Edge val="east"><SubDAG type="template" idref="yes"/></Edge>
<Edge val="sample"><SubDAG type="template" idref="yes"/></Edge>
<Edge val="check"><Node var="rover_1">
<Edge val="s0"><Node var="rock_1"><Edge val="good"><SubDAG type="template" idref="yes"/></Edge><Edge val="bad"><SubDAG type="deterministic" var="sensor" val="obad"/></Edge></Node></Edge>
<Edge val="s1"><Node var="rock_1"><Edge val="good"><Node var="sensor"><Edge val="ogood"><Terminal>0.8</Terminal></Edge><Edge val="obad"><Terminal>0.2</Terminal></Edge></Node></Edge>
<Edge val="bad"><Node var="sensor"><Edge val="ogood"><Terminal>0.2</Terminal></Edge><Edge val="obad"><Terminal>0.8</Terminal></Edge></Node></Edge></Node></Edge>
<Edge val="s2"><SubDAG type="template" idref="yes"/></Edge>
</Node></Edge></Node></DAG>
<SubDAGTemplate id="yes"><SubDAG type="deterministic" var="sensor" val="ogood"/></SubDAGTemplate></Parameter></CondProb>
)";

}  // namespace feeler::planner
