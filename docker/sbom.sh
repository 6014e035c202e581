#!/bin/sh
# sbom.sh ROOT NAME: the packages below ROOT as SPDX 2.3, JSON; NAME is the one they are for.
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
dpkg-query --admindir="$admin" -W \
  -f '${Package}\t${Version}\t${Architecture}\t${source:Package}\t${source:Version}\n' |
  awk -F '\t' -v own="$name" '
    function encoded(text) {
      gsub(/%/, "%25", text); gsub(/\+/, "%2B", text); gsub(/:/, "%3A", text); gsub(/~/, "%7E", text)
      return text
    }
    function id(text) { gsub(/\+/, "-plus-", text); gsub(/[^A-Za-z0-9.-]/, "-", text); return "SPDXRef-Package-" text }
    {
      printf "%s    {\"SPDXID\": \"%s\", \"name\": \"%s\", \"versionInfo\": \"%s\",\n", sep, id($1), $1, $2
      printf "     \"downloadLocation\": \"NOASSERTION\", \"filesAnalyzed\": false,\n"
      printf "     \"licenseConcluded\": \"NOASSERTION\", \"licenseDeclared\": \"NOASSERTION\", \"copyrightText\": \"NOASSERTION\",\n"
      printf "     \"sourceInfo\": \"built from %s %s; licence: /usr/share/doc/%s/copyright\",\n", $4, $5, $1
      printf "     \"externalRefs\": [{\"referenceCategory\": \"PACKAGE-MANAGER\", \"referenceType\": \"purl\",\n"
      printf "       \"referenceLocator\": \"pkg:deb/%s/%s@%s?arch=%s&distro=bookworm\"}]}",
        $1 == own ? "vantage" : "debian", encoded($1), encoded($2), $3
      sep = ",\n"
      ids[++count] = id($1)
    }
    END {
      printf "\n  ],\n  \"relationships\": [\n"
      for (i = 1; i <= count; i++) {
        printf "    {\"spdxElementId\": \"SPDXRef-DOCUMENT\", \"relationshipType\": \"DESCRIBES\", \"relatedSpdxElement\": \"%s\"}%s\n",
          ids[i], i < count ? "," : ""
      }
      printf "  ]\n}\n"
    }'
