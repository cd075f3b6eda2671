"""The page of the documentation: folded, searched, with deep links, and all that it is given is text."""

from api.front.swagger import swagger_page


def text(title: str = "gateway", url: str = "/openapi/core.json", assets: str = "/static") -> str:
    return bytes(swagger_page(title, url, assets).body).decode()


def test_it_opens_folded_with_a_search_and_deep_links() -> None:
    page = text()
    assert 'url: "/openapi/core.json"' in page
    for option in ('docExpansion: "none"', "filter: true", "deepLinking: true", "fn: {opsFilter}"):
        assert option in page
    assert 'src="/static/swagger-ui-bundle.js"' in page


def test_no_key_is_left_in_the_browser() -> None:
    assert "persistAuthorization" not in text()


def test_what_it_is_given_stays_text() -> None:
    page = text(title="<b>", url='/"+alert(1)+"</script><b>', assets='/"><b>')
    assert "<b>" not in page
    assert page.count("</script>") == 2
    assert r'url: "/\"+alert(1)+\"\u003c/script>\u003cb>"' in page
