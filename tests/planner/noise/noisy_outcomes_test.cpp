// Laws of the outcomes of a guarded move with noise:
// - they are those of the definition, enumerated over everything that each step may do: probabilities, expected steps
//   and contacts; they sum to 1;
// - without noise there is one, that of the exact world;
// - probabilities outside [0, 1), and noise that leaves no information or no motion, are refused by name.
#include "feeler/planner/noise/noisy_outcomes.h"

#include <gtest/gtest.h>

#include <map>
#include <utility>

#include "feeler/core/error.h"

namespace feeler::planner {
namespace {

struct Enumerated {
  std::map<std::pair<int, bool>, double> outcomes;
  double steps = 0.0;
  double contact = 0.0;
};

/// From the definition: step by step, every branch followed to its end.
void Enumerate(const Noise& noise, int left, int at, int room, double probability, int spent, Enumerated& out) {
  if (probability == 0.0) return;
  if (left == 0) {
    out.outcomes[{at, false}] += probability;
    out.steps += probability * spent;
    return;
  }
  const auto stop = [&](double p) {
    out.outcomes[{at, true}] += probability * p;
    out.steps += probability * p * spent;
    out.contact += probability * p;
  };
  if (at == room) {
    stop(1.0 - noise.missed_contact);
    Enumerate(noise, left - 1, at, room, probability * noise.missed_contact, spent + 1, out);
    return;
  }
  stop(noise.false_stop);
  Enumerate(noise, left - 1, at, room, probability * noise.slip, spent + 1, out);
  Enumerate(noise, left - 1, at + 1, room, probability * (1.0 - noise.false_stop - noise.slip), spent + 1, out);
}

TEST(NoisyOutcomes, AreThoseOfTheDefinition) {
  for (const Noise noise : {Noise{0.02, 0.0, 0.0}, Noise{0.0, 0.1, 0.0}, Noise{0.0, 0.0, 0.3}, Noise{0.2, 0.1, 0.05}}) {
    NoisyMoves moves(noise);
    for (const auto& [cells, room] : {std::pair{1, 0}, {1, 1}, {4, 0}, {4, 2}, {4, 4}, {8, 5}}) {
      Enumerated expected;
      Enumerate(noise, cells, 0, room, 1.0, 0, expected);
      const NoisyMove& move = moves.Of(cells, room);
      double sum = 0.0;
      for (const NoisyOutcome& o : move.outcomes) {
        const double its = expected.outcomes[{o.outcome.cells, o.outcome.contact}];
        EXPECT_NEAR(o.probability, its, 1e-15);
        sum += o.probability;
      }
      EXPECT_NEAR(sum, 1.0, 1e-14);
      EXPECT_NEAR(move.steps, expected.steps, 1e-13);
      EXPECT_NEAR(move.contact, expected.contact, 1e-14);
      const CostWeights cost{2.0, 0.5, 0.25};
      EXPECT_NEAR(move.Cost(cost, Direction::kPlusY), 2.0 * expected.steps + 0.5 * expected.contact + 0.25, 1e-12);
    }
  }
}

TEST(NoisyOutcomes, WithoutNoiseThereIsOne) {
  NoisyMoves moves({});
  for (int room = 0; room <= 5; ++room) {
    const NoisyMove& move = moves.Of(5, room);
    ASSERT_EQ(move.outcomes.size(), 1U);
    EXPECT_EQ(move.outcomes[0].outcome, (Outcome{room, room < 5}));
    EXPECT_EQ(move.outcomes[0].probability, 1.0);
    EXPECT_EQ(move.steps, room);
  }
}

TEST(Noise, WhatSaysNothingIsRefused) {
  EXPECT_NO_THROW(Validate(Noise{0.5, 0.4, 0.4}, "here"));
  for (const Noise noise : {Noise{-0.1, 0.0, 0.0}, Noise{1.0, 0.0, 0.0}, Noise{0.0, 1.0, 0.0}, Noise{0.0, 0.0, 1.0},
                            Noise{0.6, 0.4, 0.0}, Noise{0.0, 0.5, 0.5}}) {
    EXPECT_THROW(Validate(noise, "here"), InputError);
  }
  EXPECT_NO_THROW(Validate(Declaration{1.0, 1.0}, "here"));
  for (const Declaration declaration : {Declaration{0.5, 100.0}, Declaration{1.01, 100.0}, Declaration{0.99, 0.0}}) {
    EXPECT_THROW(Validate(declaration, "here"), InputError);
  }
}

}  // namespace
}  // namespace feeler::planner
