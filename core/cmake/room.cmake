# vantage_library(NAME [APART FILE...] [PUBLIC LIBRARY...] [PRIVATE LIBRARY...]): a room of the house,
# made of every source below the current folder. Where VANTAGE_UNITY is on its files are compiled in
# pieces of eight, since what they include is most of their compile time; each of APART by itself:
# it has names of its own that others have too. Where VANTAGE_PRECOMPILE is on, what most of them
# include is compiled once for all rooms.
option(VANTAGE_UNITY "Compile libraries of many small files in a few pieces" ON)
option(VANTAGE_PRECOMPILE "Precompile what libraries and tests include most" ON)

# What most rooms include. A file by itself compiles in two thirds of the time with it; in pieces of
# eight there is little left to save.
set(VANTAGE_PRECOMPILED OFF)
if(VANTAGE_PRECOMPILE AND NOT VANTAGE_UNITY)
  set(VANTAGE_PRECOMPILED ON)
  add_library(vantage_precompiled STATIC ${CMAKE_CURRENT_LIST_DIR}/precompiled.cc)
  target_link_libraries(vantage_precompiled PRIVATE vantage_options Eigen3::Eigen absl::statusor
    absl::strings)
  target_precompile_headers(vantage_precompiled PRIVATE
    <Eigen/Core> <Eigen/Geometry> <algorithm> <array> <cmath> <cstdint> <memory> <optional> <span>
    <string> <utility> <vector> [["absl/status/statusor.h"]] [["absl/strings/str_cat.h"]])
endif()

function(vantage_library name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "APART;PUBLIC;PRIVATE")
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cc)
  add_library(${name} ${sources})
  target_link_libraries(${name} PUBLIC vantage_options ${arg_PUBLIC} PRIVATE ${arg_PRIVATE})
  vantage_pieces(${name} ${arg_APART})
  if(VANTAGE_PRECOMPILED)
    target_precompile_headers(${name} REUSE_FROM vantage_precompiled)
  endif()
endfunction()

# vantage_pieces(TARGET [FILE...]): the same for a target that exists; the files stay apart.
function(vantage_pieces target)
  set_target_properties(${target} PROPERTIES UNITY_BUILD ${VANTAGE_UNITY}
    UNITY_BUILD_BATCH_SIZE 8)
  if(ARGN)
    set_source_files_properties(${ARGN} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  endif()
endfunction()
