#!/bin/sh
# sbom.sh ROOT NAME: the packages below ROOT as SPDX 2.3, JSON; NAME is the one they are for. Those of
# npm that the page has parts of are among them, as its licences.txt names them.
set -eu
admin=$1/var/lib/dpkg
name=$2
created=$(date -u -d "@${SOURCE_DATE_EPOCH:-$(date +%s)}" +%Y-%m-%dT%H:%M:%SZ)
version=$(dpkg-query --admindir="$admin" -W -f '${Version}' "$name")
sum=$(sha256sum "$1/usr/bin/vantaged" | cut -d' ' -f1)

cat <<JSON
{
  "spdxVersion": "SPDX-2.3",
  "dataLicense": "CC0-1.0",
  "SPDXID": "SPDXRef-DOCUMENT",
  "name": "$name-$version",
  "documentNamespace": "https://spdx.org/spdxdocs/$name-$version-$sum",
  "creationInfo": {"created": "$created", "creators": ["Tool: dpkg-$(dpkg-query -W -f '${Version}' dpkg)"]},
  "packages": [
JSON
# Names, versions and architectures of Debian packages hold nothing that JSON would escape, but '+'
# and ':' and '~' stand for something else in a package URL.
page=$1/usr/share/vantage/web/licences.txt
{
  dpkg-query --admindir="$admin" -W \
    -f 'deb\t${Package}\t${Version}\t${Architecture}\t${source:Package}\t${source:Version}\n'
  [ ! -e "$page" ] || sed -nE 's/^== ([^ ]+) ([^ ]+) \((.*)\)$/npm\t\1\t\2\t\3/p' "$page"
} |
  awk -F '\t' -v own="$name" '
    function encoded(text) {
      gsub(/%/, "%25", text); gsub(/\+/, "%2B", text); gsub(/:/, "%3A", text); gsub(/~/, "%7E", text)
      return text
    }
    function id(text) { gsub(/\+/, "-plus-", text); gsub(/[^A-Za-z0-9.-]/, "-", text); return "SPDXRef-" text }
    function begin(own_id, name, version, licence) {
      printf "%s    {\"SPDXID\": \"%s\", \"name\": \"%s\", \"versionInfo\": \"%s\",\n", sep, own_id, name, version
      printf "     \"downloadLocation\": \"NOASSERTION\", \"filesAnalyzed\": false,\n"
      printf "     \"licenseConcluded\": \"NOASSERTION\", \"licenseDeclared\": \"%s\", \"copyrightText\": \"NOASSERTION\",\n", licence
      sep = ",\n"
      ids[++count] = own_id
    }
    function end(source, url) {
      printf "     \"sourceInfo\": \"%s\",\n", source
      printf "     \"externalRefs\": [{\"referenceCategory\": \"PACKAGE-MANAGER\", \"referenceType\": \"purl\",\n"
      printf "       \"referenceLocator\": \"%s\"}]}", url
    }
    $1 == "deb" {
      begin(id("Package-" $2), $2, $3, "NOASSERTION")
      end("built from " $5 " " $6 "; licence: /usr/share/doc/" $2 "/copyright",
        "pkg:deb/" ($2 == own ? "vantage" : "debian") "/" encoded($2) "@" encoded($3) "?arch=" $4 "&distro=bookworm")
    }
    $1 == "npm" {
      begin(id("Npm-" $2), $2, $3, $4)
      scoped = $2
      sub(/^@/, "%40", scoped)
      end("bundled into /usr/share/vantage/web; licence: /usr/share/vantage/web/licences.txt", "pkg:npm/" scoped "@" encoded($3))
    }
    END {
      printf "\n  ],\n  \"relationships\": [\n"
      for (i = 1; i <= count; i++) {
        printf "    {\"spdxElementId\": \"SPDXRef-DOCUMENT\", \"relationshipType\": \"DESCRIBES\", \"relatedSpdxElement\": \"%s\"}%s\n",
          ids[i], i < count ? "," : ""
      }
      printf "  ]\n}\n"
    }'
