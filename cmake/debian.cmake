# `make package`: kilvo (program, configurations, documents) and, where the node for ROS 1 is built, kilvo-ros1, as Debian packages.
# scripts/make_manual has written the manual page and the completions by then.
set(documents ${CMAKE_INSTALL_DATADIR}/doc/kilvo)
# Links lead to what is there under another name.
file(READ README.md readme)
string(REPLACE "](CHANGELOG.md)" "](CHANGELOG.md.gz)" readme "${readme}")
string(REPLACE "](LICENSE)" "](copyright)" readme "${readme}")
file(WRITE ${CMAKE_BINARY_DIR}/README.md "${readme}")
install(FILES ${CMAKE_BINARY_DIR}/README.md CITATION.cff DESTINATION ${documents} COMPONENT program)
install(DIRECTORY docs/ DESTINATION ${documents}/docs COMPONENT program)
install(FILES tests/consumer/main.cpp DESTINATION ${documents}/tests/consumer COMPONENT program)
set(manual ${CMAKE_BINARY_DIR}/manual)
install(FILES ${manual}/kilvo.1.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program OPTIONAL)
install(FILES ${manual}/kilvo.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME kilvo COMPONENT program OPTIONAL)
install(FILES ${manual}/_kilvo DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions COMPONENT program OPTIONAL)

set(CPACK_PACKAGE_NAME kilvo)
set(CPACK_PACKAGE_VENDOR "KILVO")
set(CPACK_PACKAGE_CONTACT "KILVO maintainers <maintainers@kilvo.invalid>")
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL program)
if(TARGET kilvo_node)
  list(APPEND CPACK_COMPONENTS_ALL ros1)
endif()
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME kilvo)
set(CPACK_COMPONENT_PROGRAM_DESCRIPTION "The program kilvo reads recordings, estimates the trajectory of the robot,
which foot stands, and a coloured map, compares them with the truth and
shows them as a page for the browser. A simulated robot is included.")
set(CPACK_DEBIAN_ROS1_PACKAGE_NAME kilvo-ros1)
set(CPACK_DEBIAN_ROS1_PACKAGE_DEPENDS "kilvo (= ${PROJECT_VERSION})")
set(CPACK_COMPONENT_ROS1_DESCRIPTION "The node kilvo_node for ROS 1 listens to joint encoders, IMU, LiDAR and
camera and publishes odometry, transforms, clouds, contacts and diagnostics.")

# What Debian asks of every package: copyright and changelog.
file(WRITE ${CMAKE_BINARY_DIR}/copyright "Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/
Upstream-Name: KILVO

Files: *
Copyright: 2026 The KILVO contributors
License: Apache-2.0
 The full text is in /usr/share/common-licenses/Apache-2.0.
")
string(TIMESTAMP package_date "%a, %d %b %Y 00:00:00 +0000" UTC)
foreach(package kilvo kilvo-ros1)
  file(WRITE ${CMAKE_BINARY_DIR}/${package}/changelog "${package} (${PROJECT_VERSION}) bookworm; urgency=medium

  * See /usr/share/doc/kilvo/CHANGELOG.md.gz.

 -- ${CPACK_PACKAGE_CONTACT}  ${package_date}
")
  execute_process(COMMAND gzip -9nf changelog WORKING_DIRECTORY ${CMAKE_BINARY_DIR}/${package})
endforeach()
execute_process(COMMAND gzip -9nc CHANGELOG.md WORKING_DIRECTORY ${PROJECT_SOURCE_DIR} OUTPUT_FILE ${CMAKE_BINARY_DIR}/CHANGELOG.md.gz)
install(FILES ${CMAKE_BINARY_DIR}/copyright ${CMAKE_BINARY_DIR}/kilvo/changelog.gz ${CMAKE_BINARY_DIR}/CHANGELOG.md.gz DESTINATION ${documents}
        COMPONENT program)
install(FILES ${CMAKE_BINARY_DIR}/copyright ${CMAKE_BINARY_DIR}/kilvo-ros1/changelog.gz DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/kilvo-ros1
        COMPONENT ros1)
include(CPack)
