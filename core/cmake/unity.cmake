# Compiles the files of a target in pieces of eight, since what they include is most of their
# compile time; each of APART by itself: names of its own that others have too, or large.
# VANTAGE_UNITY=OFF compiles every file by itself, which suits working on one of them.
function(vantage_unity target)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "APART")
  set_target_properties(${target} PROPERTIES UNITY_BUILD ${VANTAGE_UNITY}
    UNITY_BUILD_BATCH_SIZE 8)
  if(arg_APART)
    set_source_files_properties(${arg_APART} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  endif()
endfunction()
