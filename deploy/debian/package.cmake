# Debian packages: cd build/release && cpack (after the target 'installable'), or ./dev package.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME vantage)
set(CPACK_PACKAGE_CONTACT "Vantage maintainers <maintainers@vantage.invalid>")
set(CPACK_PACKAGE_DIRECTORY ${CMAKE_BINARY_DIR}/package)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_COMPONENTS_ALL server client coredev clientdev)
if(TARGET vantage_core_python)
  list(APPEND CPACK_COMPONENTS_ALL pythoncore)
endif()
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
# From the libraries that the binaries load.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)

set(CPACK_DEBIAN_SERVER_PACKAGE_NAME vantage-server)
set(CPACK_DEBIAN_SERVER_PACKAGE_SECTION science)
set(CPACK_DEBIAN_SERVER_PACKAGE_DEPENDS "adduser, init-system-helpers (>= 1.54~)")
# Without a proxy the server is for its own machine, or for callers with certificates.
set(CPACK_DEBIAN_SERVER_PACKAGE_RECOMMENDS "haproxy (>= 2.6)")
set(CPACK_DEBIAN_SERVER_PACKAGE_SUGGESTS vantage-client)
set(CPACK_COMPONENT_SERVER_DESCRIPTION "planner of scanner positions, the server
 Plans where the tripod of a laser scanner should stand next, from the scans made so far.
 Serves the API vantage.v1 over gRPC, and a page for tablets.")
set(extra ${CMAKE_CURRENT_SOURCE_DIR}/debian/server)
set(CPACK_DEBIAN_SERVER_PACKAGE_CONTROL_EXTRA
  "${extra}/conffiles;${extra}/postinst;${extra}/prerm;${extra}/postrm")
# Scripts are executable whatever the mask of whoever checked them out.
set(CPACK_DEBIAN_SERVER_PACKAGE_CONTROL_STRICT_PERMISSION ON)

set(CPACK_DEBIAN_CLIENT_PACKAGE_NAME vantage-client)
set(CPACK_DEBIAN_CLIENT_PACKAGE_SECTION science)
set(CPACK_COMPONENT_CLIENT_DESCRIPTION "planner of scanner positions, the command line
 Creates jobs, sends scans, shows where the scanner should stand next.")

# What programs of others are built with: static libraries, so they need what these are linked with.
set(CPACK_DEBIAN_COREDEV_PACKAGE_NAME libvantage-core-dev)
set(CPACK_DEBIAN_COREDEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_COREDEV_PACKAGE_DEPENDS "libabsl-dev, libceres-dev (>= 2.1), libeigen3-dev (>= 3.4), \
libembree-dev (>= 3), libembree-dev (<< 4), liblzf-dev, liboctomap-dev, libpcl-features1.13, libpcl-filters1.13, \
libpcl-registration1.13, libpcl-segmentation1.13, libpugixml-dev, libssl-dev, libzstd-dev")
set(CPACK_DEBIAN_COREDEV_PACKAGE_SUGGESTS libvantage-client-dev)
set(CPACK_COMPONENT_COREDEV_DESCRIPTION "planner of scanner positions, as a C++ library
 Merges scans into a model of what is known, and plans where the tripod should stand next.
 Headers below vantage/, a static library, and vantage::core for find_package of CMake.")

set(CPACK_DEBIAN_CLIENTDEV_PACKAGE_NAME libvantage-client-dev)
set(CPACK_DEBIAN_CLIENTDEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_CLIENTDEV_PACKAGE_DEPENDS "libvantage-core-dev (= ${PROJECT_VERSION}), libgrpc++-dev, \
libprotobuf-dev, protobuf-compiler-grpc")
set(CPACK_DEBIAN_CLIENTDEV_PACKAGE_SUGGESTS vantage-server)
set(CPACK_COMPONENT_CLIENTDEV_DESCRIPTION "planner of scanner positions, the client as a C++ library
 Calls with retries, uploads and watches that outlive their links, errors in words.
 Headers below vantage/, a static library, and vantage::client for find_package of CMake.")

# Debian's Python, of one version: the module is compiled for that.
set(CPACK_DEBIAN_PYTHONCORE_PACKAGE_NAME python3-vantage-core)
set(CPACK_DEBIAN_PYTHONCORE_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHONCORE_PACKAGE_DEPENDS "python3 (>= 3.11), python3 (<< 3.12), python3-numpy")
set(CPACK_COMPONENT_PYTHONCORE_DESCRIPTION "planner of scanner positions, for Python
 Carves, registers and plans on NumPy arrays, without a server: import vantage_core.")
include(CPack)
