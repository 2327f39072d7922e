// Around the page that is shown: what goes wrong in drawing it leaves the head, the link's state and STOP.
import { Component, html } from "./html.js";
import { say, sayWith } from "./language.js";

export class Boundary extends Component {
  componentDidCatch(error) {
    console.error(error);
    this.setState({ failedAt: this.props.route, text: error.message });
  }

  render({ route, children }, { failedAt, text }) {
    if (failedAt !== route) return children; // gone elsewhere: another try
    return html`
      <section class="card empty" role="alert"><h2>${say("The page cannot be shown")}</h2>
        <p>${sayWith("It failed: {text}.", { text: html`<span lang="en">${text}</span>` })} <button class="tab" onClick=${() => this.setState({ failedAt: null })}>${say("Try again")}</button></p></section>
    `;
  }
}
