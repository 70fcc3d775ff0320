#!/usr/bin/env python3
"""Takes one guard against loss or silence out of the sources at a time; its test must be red without it.

    tests/mutation/guards.py [--build build] [--only WORD] [--list]

Each guard below names a file, the text that guards, what stands there instead, and the tests that must notice. Sources
are changed in place, built, tested and restored: run it in a clean tree. Exit code 1 if a test stays green, or a text
is not found. docs/testing.md says which promise each one keeps. Needs Python 3.9 and what the build needs.
"""
import argparse
import os
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))

# promise, file, guard, instead, binary, tests
GUARDS = [
    ("output: not an input", "cli/common/outputs.cpp",
     "if (!input.empty() && IsReplaceable(output.path) && IsSameFile(output.path, input)) {", "if (false) {",
     "cli_tests", "Output.ThatIsAnInputIsRefused"),
    ("output: of its kind", "cli/common/outputs.cpp", "if (kind.recognises(HeadOf(output.path))) return;",
     "if (kind.recognises(HeadOf(output.path)) || true) return;",
     "cli_tests", "Output.AFileOfAnotherKindIsKept"),
    ("output: what stands beside it", "workflow/perception/calibrate.cpp", "RequireOwnPoses(options.partial, settings);",
     "if (false) RequireOwnPoses(options.partial, settings);", "cli_tests", "Output.WhatABundleACalibrationOrAFolderWouldReplaceIsKept"),
    ("output: whole or not at all", "core/file_output.cpp", "if (!direct()) unlink(part_.c_str());", "",
     "cli_tests", "OutputFile.StandsWholeOrNotAtAll"),
    ("output: imports", "cad/folder/task_folder.cpp", "if (IsSameFile(path, input)) {", "if (false) {", "cli_tests",
     "Output.AnImportReplacesWhatAnImportWroteAlone"),
    ("streams: closed ones are opened", "cli/common/program.cpp", "  OpenClosedStreams();", "", "cli_tests",
     "Streams.AClosedOneIsNoDatabase"),
    ("streams: lost results", "cli/common/console.cpp",
     "if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0 || !std::cout) NoteLoss(errno);", "", "cli_tests",
     "Streams.LostResultsAreAnError"),
    ("signals: nohup", "cli/common/signals.cpp",
     "if (number == SIGHUP && before.sa_handler == SIG_IGN) continue;  // nohup", "", "cli_tests",
     "Signals.AnIgnoredHangupStaysIgnored"),
    ("numbers: all of the text", "cli/common/numbers.cpp", "const bool whole_text = rest == end;",
     "const bool whole_text = true;", "cli_tests", "Numbers.*"),
    ("machine: refused memory", "cli/common/program.cpp", "return FailForLackOf(\"memory\", MemoryRefused(), kMemory);",
     "return Fail(MemoryRefused(), 3);", "cli_tests", "Machine.RefusedMemoryAndThreadsAreOneLine"),
    ("readers: JSON depth", "core/json_depth.h", "if (++depth > levels) return true;", "++depth;", "core_tests",
     "JsonDepth.*"),
    ("readers: depth in another unit", "cli/perceived_target.cpp",
     "if (!found.found) found.reason += perception::GuessDepthUnit(depth, *camera, expected_m);", "", "cli_tests",
     "Perceive.ADepthImageInAnotherUnitIsGuessed"),
    ("messages: one printable line", "core/error.cpp", "length == 0 || byte < 0x20 || byte == 0x7f", "length == 0",
     "core_tests", "Messages.*"),
    ("tasks: margins", "env/model/contact_settings.cpp", "if (value == 0) continue;", "continue;", "env_tests",
     "ContactSettings.*"),
    ("tasks: how contact feels", "env/model/contact_settings.cpp", "add(model.geom_solref + mjNREF * geom, mjNREF);", "",
     "env_tests", "ContactParameters.*"),
    ("numbers in MJCF", "env/mjcf/mjcf_numbers.cpp", "if (std::isnan(value)) return \"is not a number\";", "",
     "env_tests", "Numbers.*"),
    ("numbers in MJCF: where", "env/model/task_xml.cpp",
     "RequireFiniteNumbers(*part.RootElement(), part_name);  // here, where its lines are its own", "", "env_tests",
     "Numbers.*"),
    ("states of another model", "env/scene/world.cpp", "s.model != fingerprint_ || ", "", "env_tests",
     "SceneRefusals.AStateOfAnotherModelOrOfNoNumbers"),
    ("locale of the host", "core/text/plain_locale.cpp", "std::locale::global(std::locale::classic());", "", "env_tests",
     "Locale.*"),
    ("perception: a match explains what it sees", "perception/registration.cpp",
     "best.found = limits.Allow(best);", "best.found = best.fitness >= limits.least_fitness;", "perception_tests",
     "Registration.APlateIsNotTheTarget"),
    ("perception: the background tells", "perception/registration.cpp", "measured.empty() ? finite : measured", "finite",
     "perception_tests", "Registration.TheBackgroundTellsWhereTheCameraSeesThrough"),
    ("perception: limits of the calibration", "perception/match_evidence.cpp",
     "std::max(worst, std::min(most, std::sqrt(worst * weakest)))", "most", "perception_tests", "MatchLimits.*"),
    ("exports: stated size", "policies/io/pomdp_export.cpp", "if (text.size() <= options.max_bytes) return;", "return;",
     "policies_tests", "PomdpExport.RefusesWhatItCannotSay"),
    ("exports: upper bound", "policies/io/pomdp_export.cpp",
     "if (std::isfinite(options.upper_bound)) RequireUpperBound(problem, options.upper_bound);",
     "if (options.upper_bound < 0) RequireUpperBound(problem, options.upper_bound);", "policies_tests",
     "PomdpExport.RefusesWhatItCannotSay"),
]


def build(folder, binary):
    targets = [binary] + (["feeler"] if binary == "cli_tests" else [])
    return subprocess.run(["cmake", "--build", folder, "-j2", "--target"] + targets, cwd=ROOT, capture_output=True)


def try_guard(guard, folder):
    promise, name, text, instead, binary, tests = guard
    path = os.path.join(ROOT, name)
    with open(path, encoding="utf-8") as file:
        sound = file.read()
    if sound.count(text) != 1:
        return "the guard stands %d times in %s" % (sound.count(text), name)
    try:
        with open(path, "w", encoding="utf-8") as file:
            file.write(sound.replace(text, instead))
        if build(folder, binary).returncode != 0:
            return "does not build without it"
        run = subprocess.run([os.path.join(folder, binary), "--gtest_filter=" + tests, "--gtest_brief=1"], cwd=ROOT,
                             capture_output=True, timeout=1200)
        return "green without its guard" if run.returncode == 0 else None
    finally:
        with open(path, "w", encoding="utf-8") as file:
            file.write(sound)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--build", default="build")
    parser.add_argument("--only", default="")
    parser.add_argument("--list", action="store_true")
    args = parser.parse_args()
    folder = os.path.join(ROOT, args.build)
    guards = [guard for guard in GUARDS if args.only in guard[0]]
    faults = 0
    for guard in guards:
        if args.list:
            print("%-45s %-40s %s" % (guard[0], guard[1], guard[5]))
            continue
        fault = try_guard(guard, folder)
        faults += fault is not None
        print("%-45s %s" % (guard[0], fault or "red, as it must be"), flush=True)
    for binary in () if args.list else sorted(set(guard[4] for guard in guards)):
        build(folder, binary)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
