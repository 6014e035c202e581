# cmake -DLICENSE=FILE -DPAGE=FILE -DTO=FILE -P copyright.cmake: the copyright file of a package, which is our
# licence and, where the package has the page, those of what npm's packages brought into it (licences.txt).
file(READ "${LICENSE}" text)
if(EXISTS "${PAGE}")
  file(READ "${PAGE}" page)
  string(APPEND text "
===============================================================================
/usr/share/vantage/web, the page for tablets.
${page}")
endif()
file(WRITE "${TO}" "${text}")
