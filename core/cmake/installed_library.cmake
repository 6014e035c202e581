# What other programs are built with: a static library, its headers below vantage/, and the target
# that find_package(vantage CONFIG) makes of them.
include(GNUInstallDirs)
set(VANTAGE_CONFIG_FOLDER ${CMAKE_INSTALL_LIBDIR}/cmake/vantage)

# vantage_installed(PART OBJECTS ROOM... [SOURCES FILE...] HEADERS FILE... ROOTS FOLDER...
# [GIVEN NAMES] LINK LIBRARY... [HIDDEN LIBRARY...]): vantage::PART is made of the objects of these rooms. HEADERS are
# what it is used by; what they include of ours comes along, but for what GIVEN (a regular expression)
# matches, which another part installs. ROOTS are where these are looked for.
# HIDDEN libraries are linked and not included. The install component is PARTdev.
function(vantage_installed part)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "GIVEN" "OBJECTS;SOURCES;HEADERS;ROOTS;LINK;HIDDEN")
  set(target vantage_${part}_installed)
  list(TRANSFORM arg_OBJECTS REPLACE "(.+)" "$<TARGET_OBJECTS:\\1>" OUTPUT_VARIABLE objects)
  add_library(${target} STATIC EXCLUDE_FROM_ALL ${arg_SOURCES} ${objects})
  set_target_properties(${target} PROPERTIES OUTPUT_NAME vantage-${part} EXPORT_NAME ${part}
    LINKER_LANGUAGE CXX)
  # As ours are compiled; nothing of that is handed on but what follows.
  target_compile_options(${target} PRIVATE
    $<TARGET_PROPERTY:vantage_options,INTERFACE_COMPILE_OPTIONS>)
  list(TRANSFORM arg_HIDDEN REPLACE "(.+)" "$<INSTALL_INTERFACE:$<LINK_ONLY:\\1>>"
    OUTPUT_VARIABLE hidden)
  target_link_libraries(${target} PUBLIC ${arg_LINK} INTERFACE ${hidden})
  target_include_directories(${target} INTERFACE $<INSTALL_INTERFACE:include>)
  target_compile_features(${target} INTERFACE cxx_std_20)

  install(TARGETS ${target} EXPORT vantage-${part}-targets ARCHIVE COMPONENT ${part}dev)
  install(EXPORT vantage-${part}-targets NAMESPACE vantage:: DESTINATION ${VANTAGE_CONFIG_FOLDER}
    COMPONENT ${part}dev)
  # An archive is not stripped by CMake, and four fifths of it are lines for debuggers.
  install(CODE "
    if(CMAKE_INSTALL_DO_STRIP)
      execute_process(COMMAND \"${CMAKE_STRIP}\" --strip-debug
        \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_LIBDIR}/libvantage-${part}.a\"
        COMMAND_ERROR_IS_FATAL ANY)
    endif()" COMPONENT ${part}dev)
  # As they are when they are installed.
  set(staged ${CMAKE_CURRENT_BINARY_DIR}/installed-headers)
  install(CODE "
    set(TO \"${staged}\")
    set(ROOTS \"${arg_ROOTS}\")
    set(HEADERS \"${arg_HEADERS}\")
    set(GIVEN \"${arg_GIVEN}\")
    include(\"${CMAKE_SOURCE_DIR}/core/cmake/stage_headers.cmake\")
    file(INSTALL DESTINATION \"\${CMAKE_INSTALL_PREFIX}/include\" TYPE DIRECTORY
      FILES \"${staged}/vantage\")" COMPONENT ${part}dev)
endfunction()
