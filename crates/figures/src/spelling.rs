//! Doc comments as words on a page: code in them is how the sources write symbols.

use asperity_record::GREEK;

/// Symbols in doc comments, as these write them.
const SYMBOLS: &str = "F_T / F_N, L_p / L, L_p = L, mu_s / mu_d, mu_d, mu_s, mu_s F_N, mu_d F_N, mu_s p_n, mu_d p_n, \
                       f_0 F_N, f_0 p_n, tau / p, tau_n / p_n, tau_n, tau, 2 tau / gamma, alpha, \
                       alpha = (mu_s + mu_d) / 2, F_N, F_T, p";

/// The words of a doc comment as they stand on a page.
pub fn spelled(text: &str) -> String {
    let mut line: String = text.split_whitespace().collect::<Vec<_>>().join(" ");
    for symbol in SYMBOLS.split(", ") {
        let close = symbol.replace(" / ", "/").replace("2 tau", "2τ");
        let printed = GREEK.iter().fold(close, |printed, (word, letter)| printed.replace(word, letter));
        line = line.replace(&format!("`{symbol}`"), &printed);
    }
    line
}
