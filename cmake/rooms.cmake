# Helpers that turn folders into targets.

add_library(feeler_options INTERFACE)
# Headers are spelled "feeler/ROOM/..." in the tree as where they are installed: the build tree holds a folder `feeler` with
# a link to each room.
file(MAKE_DIRECTORY ${PROJECT_BINARY_DIR}/include/feeler)
foreach(room core planner policies execution env cad perception workflow evaluation cli)
  file(CREATE_LINK ${PROJECT_SOURCE_DIR}/${room} ${PROJECT_BINARY_DIR}/include/feeler/${room} SYMBOLIC)
endforeach()
target_include_directories(feeler_options INTERFACE ${PROJECT_BINARY_DIR}/include)
target_compile_options(feeler_options INTERFACE -Wall -Wextra -Wshadow -Wpedantic -ffp-contract=off)
target_compile_definitions(feeler_options INTERFACE FEELER_VERSION="${PROJECT_VERSION}")
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # GCC 12 reports false overlaps in `"text" + std::string` (GCC bug 105651) and false sizes in comparisons of byte
  # vectors (GCC bug 107852).
  target_compile_options(feeler_options INTERFACE -Wno-restrict -Wno-stringop-overread)
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

# feeler_room(NAME DEPENDENCY...): target feeler::NAME from the sources in the folder NAME (main.cpp excepted).
function(feeler_room name)
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${name}/*.cpp)
  list(FILTER sources EXCLUDE REGEX "/main\\.cpp$")
  list(FILTER sources EXCLUDE REGEX "/cad/step/")  # feeler::cad_step, which alone links Open CASCADE
  if(sources)
    add_library(feeler_${name} STATIC ${sources})
    target_link_libraries(feeler_${name} PUBLIC feeler_options ${ARGN})
  else()
    add_library(feeler_${name} INTERFACE)
    target_link_libraries(feeler_${name} INTERFACE feeler_options ${ARGN})
  endif()
  add_library(feeler::${name} ALIAS feeler_${name})
endfunction()

# feeler_tests(ROOM): executable ROOM_tests from tests/ROOM/*.cpp, each test registered with ctest.
function(feeler_tests room)  # the tests of `cli` run the binary
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/tests/${room}/*.cpp)
  list(FILTER sources EXCLUDE REGEX "/tests/cad/kinds/")  # feeler::part_shapes
  if(NOT sources)
    return()
  endif()
  add_executable(${room}_tests ${sources})
  target_link_libraries(${room}_tests PRIVATE feeler::${room} GTest::gtest GTest::gmock GTest::gtest_main)
  target_include_directories(${room}_tests PRIVATE ${PROJECT_SOURCE_DIR})  # "tests/..."
  target_compile_definitions(${room}_tests PRIVATE FEELER_SOURCE_DIR="${PROJECT_SOURCE_DIR}" FEELER_BINARY="${PROJECT_BINARY_DIR}/feeler")
  # A test is compiled more often than its own code runs long; what it tests is in the rooms, optimised in full.
  target_compile_options(${room}_tests PRIVATE $<$<CONFIG:Release>:-O1>)
  if(room STREQUAL cli)
    add_dependencies(cli_tests feeler)
  endif()
  gtest_discover_tests(${room}_tests DISCOVERY_TIMEOUT 120 PROPERTIES TIMEOUT 600 LABELS ${room})
endfunction()

# Libraries whose packages ship no usable CMake target. Their headers are system headers: our warnings are for our code.
find_library(MUJOCO_LIBRARY mujoco REQUIRED)
find_path(MUJOCO_INCLUDE_DIR mujoco/mujoco.h REQUIRED)
add_library(feeler_mujoco INTERFACE)
target_include_directories(feeler_mujoco SYSTEM INTERFACE ${MUJOCO_INCLUDE_DIR})
target_link_libraries(feeler_mujoco INTERFACE ${MUJOCO_LIBRARY})
add_library(feeler::mujoco ALIAS feeler_mujoco)

find_package(PkgConfig REQUIRED)
pkg_check_modules(URDFDOM REQUIRED IMPORTED_TARGET urdfdom)
add_library(feeler_urdfdom INTERFACE)
target_link_libraries(feeler_urdfdom INTERFACE PkgConfig::URDFDOM)
add_library(feeler::urdfdom ALIAS feeler_urdfdom)

pkg_check_modules(EGL REQUIRED IMPORTED_TARGET egl)
pkg_check_modules(TINYXML2 REQUIRED IMPORTED_TARGET tinyxml2)
add_library(feeler_egl INTERFACE)
target_link_libraries(feeler_egl INTERFACE PkgConfig::EGL)
add_library(feeler::egl ALIAS feeler_egl)
add_library(tinyxml2 ALIAS PkgConfig::TINYXML2)

find_package(ompl REQUIRED)
add_library(feeler_ompl INTERFACE)
target_include_directories(feeler_ompl SYSTEM INTERFACE ${OMPL_INCLUDE_DIRS})
# Debian's omplConfig also lists Boost libraries and ODE, which its package does not bring and we do not use.
list(GET OMPL_LIBRARIES 0 FEELER_OMPL_LIBRARY)
target_link_libraries(feeler_ompl INTERFACE ${FEELER_OMPL_LIBRARY})
add_library(feeler::ompl ALIAS feeler_ompl)

# Debian's CMake package of OpenCV wants every module; these are the ones used.
add_library(feeler_opencv INTERFACE)
find_path(OPENCV_INCLUDE_DIR opencv2/core.hpp PATH_SUFFIXES opencv4 REQUIRED)
target_include_directories(feeler_opencv SYSTEM INTERFACE ${OPENCV_INCLUDE_DIR})
foreach(module core imgproc features2d)
  find_library(OPENCV_${module}_LIBRARY opencv_${module} REQUIRED)
  target_link_libraries(feeler_opencv INTERFACE ${OPENCV_${module}_LIBRARY})
endforeach()
add_library(feeler::opencv ALIAS feeler_opencv)
find_library(OPENCV_imgcodecs_LIBRARY opencv_imgcodecs REQUIRED)
add_library(feeler_imgcodecs INTERFACE)
target_link_libraries(feeler_imgcodecs INTERFACE feeler_opencv ${OPENCV_imgcodecs_LIBRARY})
add_library(feeler::imgcodecs ALIAS feeler_imgcodecs)

find_path(NANOFLANN_INCLUDE_DIR nanoflann.hpp REQUIRED)
add_library(feeler_nanoflann INTERFACE)
target_include_directories(feeler_nanoflann SYSTEM INTERFACE ${NANOFLANN_INCLUDE_DIR})
add_library(feeler::nanoflann ALIAS feeler_nanoflann)

# Readers of meshes, convex hulls, and STEP. Open CASCADE's headers are heavy: few files include them.
find_package(assimp REQUIRED)
add_library(feeler_assimp INTERFACE)
target_link_libraries(feeler_assimp INTERFACE assimp::assimp)
add_library(feeler::assimp ALIAS feeler_assimp)

find_library(QHULL_LIBRARY qhull_r REQUIRED)
find_path(QHULL_INCLUDE_DIR libqhull_r/libqhull_r.h REQUIRED)
add_library(feeler_qhull INTERFACE)
target_include_directories(feeler_qhull SYSTEM INTERFACE ${QHULL_INCLUDE_DIR})
target_link_libraries(feeler_qhull INTERFACE ${QHULL_LIBRARY})
add_library(feeler::qhull ALIAS feeler_qhull)

add_library(feeler_opencascade INTERFACE)
find_path(OPENCASCADE_INCLUDE_DIR STEPControl_Reader.hxx PATH_SUFFIXES opencascade REQUIRED)
target_include_directories(feeler_opencascade SYSTEM INTERFACE ${OPENCASCADE_INCLUDE_DIR})
foreach(module TKSTEP TKSTEPBase TKXSBase TKMesh TKShHealing TKBO TKPrim TKTopAlgo TKGeomAlgo TKBRep TKGeomBase TKG3d TKG2d TKMath
        TKernel)
  find_library(OPENCASCADE_${module}_LIBRARY ${module} REQUIRED)
  target_link_libraries(feeler_opencascade INTERFACE ${OPENCASCADE_${module}_LIBRARY})
endforeach()
add_library(feeler::opencascade ALIAS feeler_opencascade)
