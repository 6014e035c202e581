# PCL without VTK and Qt: Debian's libpcl-dev pulls 645 MB of them, and find_package(PCL) demands
# them. Only the runtime libraries are installed; the headers are unpacked by ./dev into
# VANTAGE_PCL_HEADERS (the usual prefix serves where libpcl-dev is installed).
set(VANTAGE_PCL_HEADERS "" CACHE PATH "Where ./dev unpacked libpcl-dev and libflann-dev")
find_path(PCL_INCLUDE_DIR pcl/point_types.h
  HINTS ${VANTAGE_PCL_HEADERS}/usr/include/pcl-1.13 /usr/include/pcl-1.13 REQUIRED)
find_path(FLANN_INCLUDE_DIR flann/flann.hpp HINTS ${VANTAGE_PCL_HEADERS}/usr/include REQUIRED)

add_library(slim_pcl INTERFACE)
target_include_directories(slim_pcl SYSTEM INTERFACE ${PCL_INCLUDE_DIR} ${FLANN_INCLUDE_DIR})
target_link_libraries(slim_pcl INTERFACE Eigen3::Eigen)
foreach(part common kdtree search octree sample_consensus features filters registration segmentation)
  find_library(PCL_${part}_LIBRARY NAMES libpcl_${part}.so.1.13 pcl_${part} REQUIRED)
  target_link_libraries(slim_pcl INTERFACE ${PCL_${part}_LIBRARY})
endforeach()
