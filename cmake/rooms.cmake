# Helpers that turn folders into targets.
include(GNUInstallDirs)

# What every room and every user of one gets: where headers lie, spelled "feeler/ROOM/..." in the tree as where they are
# installed (the build tree holds a folder `feeler` with a link to each room), and the language.
set(FEELER_INCLUDE_DIR ${PROJECT_BINARY_DIR}/include)
file(MAKE_DIRECTORY ${FEELER_INCLUDE_DIR}/feeler)
foreach(room core planner policies execution env cad perception workflow evaluation cli)
  file(CREATE_LINK ${PROJECT_SOURCE_DIR}/${room} ${FEELER_INCLUDE_DIR}/feeler/${room} SYMBOLIC)
endforeach()
configure_file(${PROJECT_SOURCE_DIR}/cmake/version.h.in ${FEELER_INCLUDE_DIR}/feeler/version.h @ONLY)

# How our own code is compiled; nothing of it reaches who links a room.
add_library(feeler_options INTERFACE)
target_compile_options(feeler_options INTERFACE -Wall -Wextra -Wshadow -Wpedantic -ffp-contract=off)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # GCC 12 reports false overlaps in `"text" + std::string` (GCC bug 105651) and false sizes in comparisons of byte
  # vectors (GCC bug 107852).
  # The default collects garbage of the compiler every few ten MB: a twentieth of the time.
  target_compile_options(feeler_options INTERFACE -Wno-restrict -Wno-stringop-overread --param=ggc-min-heapsize=524288)
endif()
if(FEELER_WERROR)
  target_compile_options(feeler_options INTERFACE -Werror)
endif()
if(FEELER_SANITIZE)
  # -Wmaybe-uninitialized reports false positives in instrumented code (the GCC manual says so).
  target_compile_options(feeler_options INTERFACE -fsanitize=${FEELER_SANITIZE} -fno-omit-frame-pointer
                         -fno-sanitize-recover=all -Wno-maybe-uninitialized)
  target_link_options(feeler_options INTERFACE -fsanitize=${FEELER_SANITIZE})
endif()

# feeler_unity(TARGET HEADERS SOURCE...): one translation unit a folder, and what nearly every folder includes parsed once:
# HEADERS is the target whose precompiled headers it takes ("": none). Most of the time goes into the same templates (Eigen,
# JSON, the standard library), file after file.
function(feeler_unity target headers)
  if(NOT FEELER_UNITY)
    return()
  endif()
  foreach(source ${ARGN})
    file(RELATIVE_PATH path ${PROJECT_SOURCE_DIR} ${source})
    get_filename_component(folder ${path} DIRECTORY)
    string(REPLACE "/" "_" group ${folder})
    set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${group})
  endforeach()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  if(headers)
    target_precompile_headers(${target} REUSE_FROM ${headers})
  endif()
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # Warnings about what only one source file knows, seen from another, and those of GCC bug 105651 where the headers
    # are precompiled: `dev` and the lint compile files one by one.
    target_compile_options(${target} PRIVATE -Wno-subobject-linkage -Wno-shadow -Wno-array-bounds -Wno-stringop-overflow)
  endif()
endfunction()

# feeler_headers(NAME LINKS ... HEADERS ... OPTIONS ...): precompiled headers for feeler_unity. OPTIONS are how the targets
# that take them are compiled: others would not fit.
function(feeler_headers name)
  cmake_parse_arguments(arg "" "" "LINKS;HEADERS;OPTIONS" ${ARGN})
  file(WRITE ${PROJECT_BINARY_DIR}/${name}.cpp "// Nothing: ${name} is its headers.\n")
  add_library(${name} OBJECT EXCLUDE_FROM_ALL ${PROJECT_BINARY_DIR}/${name}.cpp)
  target_compile_features(${name} PUBLIC cxx_std_20)
  target_compile_options(${name} PRIVATE ${arg_OPTIONS})
  target_link_libraries(${name} PRIVATE feeler_options ${arg_LINKS})
  target_precompile_headers(${name} PRIVATE ${arg_HEADERS})
endfunction()

# What is compiled more often than its own code runs long: commands, reports, tests.
set(FEELER_LIGHT $<$<OR:$<CONFIG:Release>,$<CONFIG:RelWithDebInfo>>:-O1>)

set(FEELER_COMPONENTS "" CACHE INTERNAL "Installed rooms")

# How rooms are compiled that a shared library can take in.
function(feeler_as_library target)
  if(FEELER_PIC OR BUILD_SHARED_LIBS)
    set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  endif()
  if(FEELER_PIC)
    # Nobody replaces our functions at run time: the compiler may inline them as in a program.
    target_compile_options(${target} PRIVATE -fno-semantic-interposition)
  endif()
endfunction()

# feeler_target(NAME SOURCES ... ROOMS ... LIBRARIES ... LINKS ...): library feeler_NAME, feeler::NAME to its users.
# ROOMS: what it uses of ours; LIBRARIES: names of feeler_find_dependency; LINKS: their targets.
function(feeler_target name)
  cmake_parse_arguments(arg "NO_INSTALL" "" "SOURCES;ROOMS;LIBRARIES;LINKS" ${ARGN})
  add_library(feeler_${name} ${arg_SOURCES})
  add_library(feeler::${name} ALIAS feeler_${name})
  set(links ${arg_ROOMS})
  list(TRANSFORM links PREPEND feeler::)
  list(APPEND links ${arg_LINKS})
  target_compile_features(feeler_${name} PUBLIC cxx_std_20)
  target_include_directories(feeler_${name} PUBLIC $<BUILD_INTERFACE:${FEELER_INCLUDE_DIR}>
                             $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_link_libraries(feeler_${name} PUBLIC ${links} PRIVATE $<BUILD_INTERFACE:feeler_options>)
  set_target_properties(feeler_${name} PROPERTIES EXPORT_NAME ${name} VERSION ${PROJECT_VERSION}
                        SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
  if(arg_NO_INSTALL)
    target_compile_options(feeler_${name} PRIVATE ${FEELER_LIGHT})
    feeler_unity(feeler_${name} feeler_cli_headers ${arg_SOURCES})
  else()
    feeler_as_library(feeler_${name})
    set(headers "")
    if(arg_ROOMS)  # core uses none of them
      set(headers feeler_room_headers)
    endif()
    feeler_unity(feeler_${name} "${headers}" ${arg_SOURCES})
  endif()
  if(NOT arg_NO_INSTALL)
    feeler_install_component(${name} "${arg_ROOMS}" "${arg_LIBRARIES}")
  endif()
endfunction()

# feeler_sources(VARIABLE FOLDER): the sources in a folder and below, main.cpp excepted.
function(feeler_sources variable folder)
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${folder}/*.cpp)
  list(FILTER sources EXCLUDE REGEX "/main\\.cpp$")
  set(${variable} ${sources} PARENT_SCOPE)
endfunction()

# feeler_tests(ROOM): executable ROOM_tests from tests/ROOM/*.cpp, each test registered with ctest. Built by the target
# `tests`.
function(feeler_tests room)  # the tests of `cli` run the binary
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/tests/${room}/*.cpp)
  list(FILTER sources EXCLUDE REGEX "/tests/cad/kinds/")  # feeler_part_shapes
  if(NOT sources)
    return()
  endif()
  add_executable(${room}_tests EXCLUDE_FROM_ALL ${sources})
  add_dependencies(tests ${room}_tests)
  feeler_unity(${room}_tests feeler_test_headers ${sources})
  target_link_libraries(${room}_tests PRIVATE feeler_options ${ARGN} fmt::fmt GTest::gtest GTest::gmock GTest::gtest_main)
  target_include_directories(${room}_tests PRIVATE ${PROJECT_SOURCE_DIR})  # "tests/..."
  target_compile_definitions(${room}_tests PRIVATE FEELER_SOURCE_DIR="${PROJECT_SOURCE_DIR}" FEELER_BINARY="${PROJECT_BINARY_DIR}/feeler")
  target_compile_options(${room}_tests PRIVATE ${FEELER_LIGHT})
  if(room STREQUAL cli)
    add_dependencies(cli_tests feeler)
  endif()
  gtest_discover_tests(${room}_tests DISCOVERY_TIMEOUT 120 PROPERTIES TIMEOUT 600 LABELS ${room})
endfunction()
